"""Recordings made in the simulated world, with effects hidden in the unit."""
