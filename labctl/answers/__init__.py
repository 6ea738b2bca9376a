"""Every request and answer, typed and described, declared once for those who make, send, draw and print it.

Typed dictionaries are what numbers are computed into; programs without pydantic read them too. Models are what
requests and responses are validated by. A key that is `NotRequired` is left out, not null, where it says nothing. All
numbers are finite; null: unknown.
"""

from labctl.lazy_imports import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
