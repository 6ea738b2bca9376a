"""Contributions to an uncertainty as a page of figures."""

from __future__ import annotations

from pathlib import Path
from typing import cast

from labctl.errors import BadInput
from labctl.json_types.budget import ContributionsOverJson
from labctl.plots.contributions import contributions_html
from labctl.services.schemas.uncertainty import UncertaintyResponse


def write_figure(answer: UncertaintyResponse, target: Path) -> None:
    """Write the contributions over rate and over temperature, one panel for each axis. Raises BadInput."""
    if target.suffix != ".html":
        raise BadInput(f"{target}: a figure is written as a page; name a file that ends in .html")
    grid = answer.grid
    if grid is None:
        raise BadInput(f"{target}: no contributions were computed; ask for the grid")
    over = {
        axis: cast(ContributionsOverJson, each.model_dump(mode="json")) for axis, each in grid.contributions.items()
    }
    title = f"{answer.serial}, version {answer.version}: contributions to the uncertainty of a corrected rate"
    target.write_text(contributions_html(title, over, answer.not_stated), encoding="utf-8")
