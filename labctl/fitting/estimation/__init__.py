"""Fitting an error model and its errors."""
