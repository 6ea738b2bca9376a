"""A calibration version compared with a recording."""
