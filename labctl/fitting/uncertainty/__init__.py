"""Uncertainty of what a calibration gives, after the GUM (JCGM 100)."""

from labctl.lazy_imports import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
