"""The method for any regular pencil."""
