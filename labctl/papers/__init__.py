"""What the three papers print, as data: numbers by place, and where a paper contradicts itself."""

from labctl.papers import ojeda2000, weiss1995, yang2018
from labctl.papers.paper import Contradiction, Paper, Printed

PAPERS: dict[str, Paper] = {paper.id: paper for paper in (ojeda2000.PAPER, yang2018.PAPER, weiss1995.PAPER)}

__all__ = ["PAPERS", "Contradiction", "Paper", "Printed"]
