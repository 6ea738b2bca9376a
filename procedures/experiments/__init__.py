"""Experiments: changes of a recipe that show what the recipe itself cannot, found by name as entry points."""
