"""Many cases, on the cores of a machine or on a cluster."""
