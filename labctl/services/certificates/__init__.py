"""Certificates of calibrations: facts from the store and the order, what is missing of them, and the issue."""
