"""The methods by one dense solve: a selection of DOFs, orthonormal bases."""
