"""Live calibration: a stream of readings while a person turns the unit, to a recording and a version."""
