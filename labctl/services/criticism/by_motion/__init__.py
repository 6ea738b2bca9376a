"""A recording by what moved the unit: bias by temperature, turns by angle, a profile in time, poses by gravity."""
