"""Criticism: a model compared with measurements. Lack of fit, where, suspects, and what cannot be tested.

This is the public face: other packages import from here only, never from a submodule.
"""

from labctl.lazy_imports import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
