"""States whose squares are energy: strain and momentum in place of displacement and velocity."""
