"""Models, systems, gains and responses in and out of files."""
