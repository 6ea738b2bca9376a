from labctl.plots.papers import paper_figure as paper_figure, paper_html as paper_html
from labctl.plots.registry import Picture as Picture, pictures_of as pictures_of
from labctl.plots.report import report_html as report_html
