"""Pictures of a criticism, from its numbers: Plotly figures for pages and for the report, and the report itself.

Everything here takes the answers as JSON, so the command line, a page and a saved file show the same plots.
"""

from labctl.lazy_imports import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
