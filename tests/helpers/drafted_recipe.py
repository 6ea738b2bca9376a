"""A recipe that ends in a draft after minutes of bench time: one temperature, five rates, a straight line."""

from __future__ import annotations

DRAFTED = """format = "labctl-recipe/1"
name = "drafted"
temperatures_c = [25]
rates_dps = [-20, -10, 0, 10, 20]
positions = ["z"]
[soak]
hold_s = 120
max_drift_c = 1.0
drift_window_s = 60
[acquire]
duration_s = 10
settle_s = 2
[fit]
effects = ["bias", "scale_factor"]
criticise = false
[fit.limits]
drift_dps = 0.08
"""
