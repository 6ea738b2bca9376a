"""Calibration while a person turns the unit: what the readings so far determine, and which pose is missing."""

from labctl.lazy_imports import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
