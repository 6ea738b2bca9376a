"""Drafts: the calibrations that campaigns end in."""
