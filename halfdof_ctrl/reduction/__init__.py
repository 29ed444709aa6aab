"""From a model to its exact states, and to few modes."""
