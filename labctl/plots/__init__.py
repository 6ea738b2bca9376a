"""Pictures of a criticism, from its numbers: Plotly figures for pages and for the report, and the report itself.

Everything here takes the answers as JSON, so the command line, a page and a saved file show the same plots.
"""

from labctl.plots.papers import paper_figure, paper_html
from labctl.plots.registry import Picture, pictures_of
from labctl.plots.report import report_html

__all__ = ["Picture", "paper_figure", "paper_html", "pictures_of", "report_html"]
