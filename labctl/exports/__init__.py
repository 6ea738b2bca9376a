"""Exports of a calibration, one module per format; found by name as entry points."""

from labctl.lazy_imports import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
