"""The calibration file: read and checked for use, made from a fit, and its certification."""

from labctl.lazy_imports import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
