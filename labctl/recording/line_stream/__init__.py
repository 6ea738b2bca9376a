"""Readings as lines of text that arrive one by one: JSON objects, or CSV with or without a header."""

from labctl.lazy_imports import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
