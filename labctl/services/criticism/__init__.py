"""A calibration version held against a recording."""
