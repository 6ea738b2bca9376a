"""Contributions to an uncertainty as lines over the rate and over the temperature, and as a page of figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from labctl.answers.budget import ContributionLinesJson, ContributionsOverJson
from labctl.answers.uncertainty import UncertaintyResponse
from labctl.errors import BadInput
from labctl.fitting.uncertainty import Budget, RateUncertainty

#: Points of a line.
POINTS = 21

Found = Callable[[float, float], Mapping[str, RateUncertainty]]


def contributions_over(
    rates_dps: list[float], temperatures_c: list[float], budgets_at: Found
) -> dict[str, ContributionsOverJson]:
    """Return axis -> lines over the rate at the middle temperature, and over the temperature at the fastest rate."""
    middle_c = temperatures_c[len(temperatures_c) // 2]
    fastest_dps = max(rates_dps, key=abs)
    rates, warm = _between(rates_dps), _between(temperatures_c)
    over_rate = [budgets_at(rate, middle_c) for rate in rates]
    over_temperature = [budgets_at(fastest_dps, each) for each in warm]
    return {
        axis: ContributionsOverJson(
            temperature_c=middle_c,
            rate_dps=fastest_dps,
            over_rate=_lines(rates, [each[axis].budget for each in over_rate]),
            over_temperature=_lines(warm, [each[axis].budget for each in over_temperature]),
        )
        for axis in over_rate[0]
    }


def _between(ends: list[float]) -> list[float]:
    low, high = min(ends), max(ends)
    return np.linspace(low, high, POINTS).tolist() if high > low else [low]


def _lines(at: list[float], budgets: list[Budget]) -> ContributionLinesJson:
    """Return a line for each source; those of one source and several standards are named apart."""
    names = dict.fromkeys(_label(budget, index) for budget in budgets for index in range(len(budget.lines)))
    by_name = [{_label(one, k): line.contribution for k, line in enumerate(one.lines)} for one in budgets]
    return ContributionLinesJson(
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
    title = f"{answer.serial}, version {answer.version}: contributions to the uncertainty of a corrected rate"
    page = contributions_html(title, grid.contributions, answer.not_stated, answer.not_stated_remedy)
    target.write_text(page, encoding="utf-8")
