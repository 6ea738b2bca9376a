"""Numbers only: a recording in, a model out. No database, no HTTP, no clock."""

from labctl.lazy_imports import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
