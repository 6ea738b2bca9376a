"""Numerical methods: least squares, drift noise, Allan deviation."""
