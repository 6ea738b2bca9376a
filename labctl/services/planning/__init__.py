"""From a recipe and a bench to a plan."""
