"""The StateSpace and what is computed with it; python-control enters here."""
