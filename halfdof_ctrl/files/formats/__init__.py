"""One file format in each file; knows `base` only."""
