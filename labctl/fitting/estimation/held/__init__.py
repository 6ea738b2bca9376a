"""Coefficients that a fit holds at known values: which, and how their uncertainty enters the others."""
