"""Data whose rate is not constant within data sets: turns by a known angle, and courses of the rate."""
