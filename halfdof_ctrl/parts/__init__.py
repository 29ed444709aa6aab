"""Mounts and other parts that come as finished models."""
