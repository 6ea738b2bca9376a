"""Sanity of a recording: what is certainly or probably wrong with it, before anything is fitted to it."""

from labctl.lazy_imports import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
