"""A fitted model as lines: over the table rate at each temperature level, and over temperature at each rate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from labctl.fitting.data.channels import Channels, body_rates
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.levels import level_centres, rate_levels, temperature_rows
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.true_rate_error import errors_at_true_rates
from labctl.fitting.numeric.arrays import Array
from labctl.services.schemas.comparison import ModelLines

#: Points of a line, besides those at the measured rates or temperatures themselves.
POINTS = 61
#: Lines of one panel; of more levels these many, evenly picked.
MOST_LINES = 24
DIGITS = 8


def lines_over(
    fitted: FittedModel, data: FitData, held: Mapping[str, float], up_dps: float
) -> tuple[list[ModelLines], list[ModelLines]]:
    """Return the lines over the table rate and those over temperature, for each output axis and position measured.

    `held` are the other channels that the model needs; `up_dps` is the Earth's rate along the table axis.
    """
    channels = data.channels
    rate = channels.table_rate_dps()
    position = np.asarray(channels["position"]).astype(np.str_)
    level = rate_levels(rate)
    rates = np.unique(level_centres(rate, level))
    over_rate, over_temperature = [], []
    for there in np.unique(position).tolist():
        for axis in (axis for axis in data.info.axes if axis in fitted.axes):
            warm = channels.temperature_c(axis)
            temperatures = np.unique(level_centres(warm, temperature_rows(warm, position, level)))

            def error(across: Array, down: Array, *, by_rate: bool, axis: str = axis, there: str = there) -> Any:
                grid = np.meshgrid(across, down)
                r, t = grid if by_rate else grid[::-1]
                return _rounded(_on_grid(fitted, axis, there, r, t, held, up_dps))

            lines, at = _picked(temperatures), _along(rates)
            over_rate.append(ModelLines(
                axis=axis, position=there, level=lines.tolist(), levels=len(temperatures), at=at.tolist(),
                error_dps=error(at, lines, by_rate=True),
            ))  # fmt: skip
            lines, at = _picked(rates, keep=0.0), _along(temperatures)
            over_temperature.append(ModelLines(
                axis=axis, position=there, level=lines.tolist(), levels=len(rates), at=at.tolist(),
                error_dps=error(at, lines, by_rate=False),
            ))  # fmt: skip
    return over_rate, over_temperature


def _picked(levels: Array, keep: float | None = None) -> Array:
    """Return all levels, or of many some evenly picked ones, and that nearest to `keep`."""
    if len(levels) <= MOST_LINES:
        return levels
    rows = np.linspace(0, len(levels) - 1, MOST_LINES // 2).round().astype(np.int64)
    if keep is not None:
        rows = np.append(rows, np.argmin(np.abs(levels - keep)))
    return levels[np.unique(rows)]


def _along(measured: Array) -> Array:
    """Return where a line is drawn: finely, and at every measured level, so that no bend lies between two points."""
    own = _picked(measured)
    return np.unique(np.concatenate([np.linspace(measured[0], measured[-1], POINTS), own]))


def _on_grid(
    fitted: FittedModel, axis: str, position: str, rate: Array, temperature: Array, held: Mapping[str, float],
    up_dps: float,
) -> Array:  # fmt: skip
    """Return the error of an output axis, in the shape of the grids of table rate and temperature."""
    n = rate.size
    there = np.full(n, position)
    columns: dict[str, Any] = {name: np.full(n, value) for name, value in held.items()}
    columns |= {"temperature_c": temperature.ravel(), "table_rate_dps": rate.ravel(), "position": there}
    here = Channels(columns, body_rates(rate.ravel() + up_dps, there))
    return errors_at_true_rates(fitted, here)[axis].reshape(rate.shape)


def _rounded(values: Array) -> list[list[float]]:
    return [[float(f"{value:.{DIGITS}g}") for value in row] for row in values.tolist()]
