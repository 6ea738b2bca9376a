"""The residual map: every measured cell of rate, temperature and position."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from labctl.answers.criticism import ResidualMap
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.criticism.residuals import Residuals
from labctl.fitting.data.levels import level_centres, rate_levels, temperature_rows, widest


def residual_maps(data: ReducedRecording, axis_residuals: Mapping[str, Residuals]) -> list[ResidualMap]:
    """Return residual over floor in rate x temperature, one map per axis and position: lists of equal length.

    `rate_level_dps` and `temperature_level_c` are the centre of the cell that a data set is drawn in, the same in all
    maps of an axis; `level_width_c` is how far the temperatures of one row are apart at most, deg C.
    """
    rate = data.at_sets(data.nodes.table_rate_dps())
    position = np.asarray(data.nodes["position"]).reshape(len(data), -1)[:, 0].astype(np.str_)
    column = rate_levels(rate)
    rate_level = level_centres(rate, column)
    maps: list[ResidualMap] = []
    for axis, residuals in axis_residuals.items():
        temperature_c = data.at_sets(data.nodes.temperature_c(axis))
        row = temperature_rows(temperature_c, position, column)
        temperature_level, width = level_centres(temperature_c, row), widest(temperature_c, row)
        for up_position in np.unique(position):
            rows = np.flatnonzero(position == up_position)
            maps.append(
                {
                    "axis": axis,
                    "position": str(up_position),
                    "dataset": data.dataset[rows].tolist(),
                    "table_rate_dps": rate[rows].tolist(),
                    "temperature_c": temperature_c[rows].tolist(),
                    "rate_level_dps": rate_level[rows].tolist(),
                    "temperature_level_c": temperature_level[rows].tolist(),
                    "level_width_c": width,
                    "residual_dps": residuals.means[rows].tolist(),
                    "over_floor": residuals.score[rows].tolist(),
                }
            )
    return maps
