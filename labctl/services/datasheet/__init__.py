"""The performance sheet of a unit, from its own recordings."""
