"""Contributions to an uncertainty as lines over the rate and over the temperature, and as a page of figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import cast

import numpy as np

from labctl.errors import BadInput
from labctl.fitting.uncertainty import Budget, RateUncertainty
from labctl.json_types.budget import ContributionsOverJson
from labctl.services.schemas.uncertainty import ContributionLines, ContributionsOver, UncertaintyResponse

#: Points of a line.
POINTS = 21

Found = Callable[[float, float], Mapping[str, RateUncertainty]]


def contributions_over(
    rates_dps: list[float], temperatures_c: list[float], uncertainty: Found
) -> dict[str, ContributionsOver]:
    """Return axis -> lines over the rate at the middle temperature, and over the temperature at the fastest rate."""
    middle_c = temperatures_c[len(temperatures_c) // 2]
    fastest_dps = max(rates_dps, key=abs)
    rates, temperatures = _between(rates_dps), _between(temperatures_c)
    over_rate = [uncertainty(rate, middle_c) for rate in rates]
    over_temperature = [uncertainty(fastest_dps, temperature) for temperature in temperatures]
    return {
        axis: ContributionsOver(
            temperature_c=middle_c,
            rate_dps=fastest_dps,
            over_rate=_lines(rates, [each[axis].budget for each in over_rate]),
            over_temperature=_lines(temperatures, [each[axis].budget for each in over_temperature]),
        )
        for axis in over_rate[0]
    }


def _between(ends: list[float]) -> list[float]:
    low, high = min(ends), max(ends)
    return np.linspace(low, high, POINTS).tolist() if high > low else [low]


def _lines(at: list[float], budgets: list[Budget]) -> ContributionLines:
    """Return a line for each source; those of one source and several standards are named apart."""
    names = dict.fromkeys(_label(budget, index) for budget in budgets for index in range(len(budget.lines)))
    by_name = [{_label(one, k): line.contribution for k, line in enumerate(one.lines)} for one in budgets]
    return ContributionLines(
        at=at,
        contributions={name: [each.get(name) for each in by_name] for name in names},
        combined=[budget.combined for budget in budgets],
        expanded=[budget.expanded for budget in budgets],
    )


def _label(budget: Budget, index: int) -> str:
    line = budget.lines[index]
    same = [one for one in budget.lines if one.source == line.source]
    return line.source if len(same) == 1 else line.name


def write_figure(answer: UncertaintyResponse, target: Path) -> None:
    """Write the contributions over rate and over temperature, one panel for each axis. Raises BadInput."""
    if target.suffix != ".html":
        raise BadInput(f"{target}: the figure is an HTML page; name a file that ends in .html")
    from labctl.plots.contributions import contributions_html  # noqa: PLC0415  0.2 s that no other command needs

    grid = answer.grid
    if grid is None:
        raise BadInput(
            f"{target}: the contributions over rate and temperature were not computed; request them with grid = true"
        )
    over = {
        axis: cast(ContributionsOverJson, contribution.model_dump(mode="json"))
        for axis, contribution in grid.contributions.items()
    }
    title = f"{answer.serial}, version {answer.version}: contributions to the uncertainty of a corrected rate"
    target.write_text(contributions_html(title, over, answer.not_stated), encoding="utf-8")
