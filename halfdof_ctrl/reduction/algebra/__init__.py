"""Scaling, factorizations and blocks of matrices; knows no model."""
