"""Verification: a version applied to a recording without refitting."""
