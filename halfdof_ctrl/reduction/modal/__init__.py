"""Truncation to few modes: approximate, with a measured error."""
