"""A recording in memory, and the interchange format it is read from and written to."""

from labctl.lazy_imports import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
