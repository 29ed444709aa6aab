"""The same methods for sparse models."""
