"""Calibration by hand: a gyro turned between rests in many poses (Tedaldi, Pretto, Menegatti, ICRA 2014)."""
