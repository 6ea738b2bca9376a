"""Calibration by hand: a gyro turned between rests that gravity tells apart (Tedaldi, Pretto, Menegatti, ICRA 2014)."""
