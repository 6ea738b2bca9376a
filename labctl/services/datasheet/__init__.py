"""The data sheet of a unit, from its own recordings."""
