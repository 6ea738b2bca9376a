"""The database: a Store has one repository for each kind of record. No other package knows SQL."""

from labctl.lazy_imports import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
