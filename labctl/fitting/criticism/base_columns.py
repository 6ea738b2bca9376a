"""Columns of the base of one axis: those of the model, shifts between recordings, and the errors of a table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.candidates import base_rows, temperature_slope
from labctl.fitting.criticism.output_lattice import lattice_columns
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.data.mounting_angles import placed_rad
from labctl.fitting.data.shifts import shift_contrasts
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.temperature import LagrangeTable
from labctl.fitting.numeric.arrays import Array

#: Standard deviation of the slope of a table at a node, over the slope: the law between the nodes is not known.
SLOPE_ERROR = 0.5


def base_of(data: ReducedRecording, model: ErrorModel, axis: str) -> tuple[NDArray[np.float64], Array]:
    """Return the coordinates of the base (R, m, k), and the prior precision of each column (k,)."""
    of_model, _, precision = base_rows(data, model, axis)
    base = of_model
    shifts, largest = shift_contrasts(data.nodes, axis, placed_rad(data.info.standards))
    if len(largest):
        base = np.concatenate([base, data.rows_of(shifts)], axis=2)
        precision = np.concatenate([precision, largest**-2.0])
    lattice, lattice_precision = lattice_columns(data, base, precision, axis)
    base, precision = np.concatenate([base, lattice], axis=2), np.concatenate([precision, lattice_precision])
    slopes = _slope_errors(data, model, axis, of_model)
    if slopes is None:
        return base, precision
    return np.concatenate([base, slopes], axis=2), np.concatenate([precision, np.ones(slopes.shape[2])])


def _slope_errors(
    data: ReducedRecording, model: ErrorModel, axis: str, base: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Return columns for errors of a table's slope on both sides of each node, (R, m, 2 nodes); None without a table.

    A table is exact at its nodes, whatever the unit's law is, but it takes the slope there from the neighbouring nodes.
    The temperatures of a level scatter by hundredths of a kelvin, so where the law is steep a wrong slope is visible.
    `base` (R, m, k) are the columns of the model.
    """
    if not isinstance(model.temperature, LagrangeTable):
        return None
    if (slope := temperature_slope(data, model, axis, base)) is None:
        return None
    nodes_c = np.asarray(model.temperature.nodes_c)
    temperature_c = data.nodes.temperature_c(axis)
    from_node_k = temperature_c[:, None] - nodes_c[None, :]
    nearest = np.argmin(np.abs(from_node_k), axis=1)[:, None] == np.arange(len(nodes_c))
    sides = np.concatenate(
        [np.where(nearest, np.minimum(from_node_k, 0.0), 0.0), np.where(nearest, np.maximum(from_node_k, 0.0), 0.0)],
        axis=1,
    )
    of_node = np.repeat(slope[0], len(temperature_c) // len(data))
    return np.asarray(SLOPE_ERROR * data.rows_of(of_node[:, None] * sides))
