"""Physical effects: one small class each, grouped by family; `catalogue.py` lists the families."""

from labctl.lazy_imports import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
