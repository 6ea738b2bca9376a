"""Characteristics of a unit in the terms of IEEE Std 528 and 952, from data sets of known rates, uncorrected."""
