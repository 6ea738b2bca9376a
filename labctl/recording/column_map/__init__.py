"""Column maps: how the columns of any log become those of a recording; read, proposed, and applied."""

from labctl.lazy_imports import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
