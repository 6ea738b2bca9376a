"""From a recipe to the list of steps."""
