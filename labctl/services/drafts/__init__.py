"""Drafts: the calibration that a campaign ends in, made, reported on, and never certified by itself."""
