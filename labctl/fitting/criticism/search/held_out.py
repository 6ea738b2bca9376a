"""Held-out check of what is to be named: data sets left out by temperature and by rate, with it and without it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.candidates import base_rows, option_of
from labctl.fitting.criticism.model_comparison import Comparison
from labctl.fitting.data.temperature.levels import folds
from labctl.fitting.effects import Effect, Term
from labctl.fitting.models.temperature import LagrangeTable
from labctl.fitting.numeric.arrays import Array
from labctl.progress import report_stage

#: An effect is not named where the held-out chi2 rises by more than this share and this amount with it.
RISES_BY, RISES_TO = 0.02, 9.0
#: At most this many groups of rates are left out in turn.
RATE_GROUPS = 8
#: A fold narrower than this, K, is a temperature level: the table's node there, within the edge, is left out with it.
NARROW_K, EDGE_K = 3.0, 0.5
MIN_EIGENVALUE = 1e-12
#: A coefficient whose signal is less than this, in noise units, has the prior of one that is as large.
MIN_SIGNAL = 1e-3


def held_out_rises(comparison: Comparison, terms: tuple[Term, ...], catalogue: Mapping[str, Effect]) -> bool:
    """Return whether leaving data sets out shows that a model predicts them worse with these terms than without.

    `comparison` is that of the model without them. The prior of each added coefficient is as wide as the coefficient is
    large in the fit to all: so a coefficient that a fold does not determine does not count against the effect.
    """
    report_stage(f"leaving data sets out to check {', '.join(term.effect for term in terms)}")
    axes = [_Axis.of(comparison, axis, terms, catalogue) for axis in comparison.axes]
    for masks in (_by_temperature(comparison), _by_rate(comparison)):
        pairs = [axis.errors(comparison, mask) for mask in masks for axis in axes]
        without, added = sum(pair[0] for pair in pairs), sum(pair[1] for pair in pairs)
        if added > (1 + RISES_BY) * without + RISES_TO:
            return True
    return False


def _by_temperature(comparison: Comparison) -> list[NDArray[np.bool_]]:
    data = comparison.data
    temperature_c = data.at_sets(data.nodes.temperature_c(data.info.axes[0]))
    masks = folds(temperature_c, thermometer=data.nodes.history.thermometer)
    inner = masks[1:-1] if isinstance(comparison.model.temperature, LagrangeTable) else masks
    return [mask for mask in inner if not mask.all()]


def _by_rate(comparison: Comparison) -> list[NDArray[np.bool_]]:
    """Return groups of neighbouring rates, without the slowest and the fastest, so that no law is extrapolated."""
    speed = np.round(np.abs(comparison.data.at_sets(comparison.data.nodes.table_rate_dps())), 1)
    levels = np.unique(speed)[1:-1]
    groups = np.array_split(levels, min(RATE_GROUPS, len(levels))) if len(levels) else []
    return [np.isin(speed, group) for group in groups]


@dataclass(frozen=True)
class _Axis:
    """One axis: data and columns over their noise."""

    name: str
    scale: NDArray[np.float64]  #: (R, m)
    y: NDArray[np.float64]  #: (R, m)
    added: NDArray[np.float64]  #: (R, m, k) columns of the terms
    precision: Array  #: (k,)

    @staticmethod
    def of(comparison: Comparison, axis: str, terms: tuple[Term, ...], catalogue: Mapping[str, Effect]) -> _Axis:
        """Return an axis with the columns of the terms, and the width of the prior from the fit to all data sets."""
        data, reference = comparison.data, comparison.model.reference
        scale = comparison.scales[axis].copy()
        scale[0] = np.sqrt(comparison.white_var[axis] + comparison.axes[axis].best.noise.size_dps ** 2)
        options = [option_of(data, axis, reference, catalogue[term.effect], term) for term in terms]
        rows = [option.rows for option in options if option is not None]
        added = np.concatenate([np.zeros((*scale.shape, 0)), *rows], axis=2) / scale[:, :, None]
        y = data.error_dps(axis) / scale
        design = comparison.designs[axis]
        base = design.base / scale[:, :, None]
        whole = np.concatenate([base, added], axis=2)
        precision = np.concatenate([design.precision, np.zeros(added.shape[2])])
        fitted = _solved(whole[data.present], y[data.present], precision)[base.shape[2] :]
        least = MIN_SIGNAL / np.maximum(np.linalg.norm(added[data.present], axis=0), MIN_SIGNAL)
        return _Axis(axis, scale, y, added, 1.0 / np.maximum(np.abs(fitted), least) ** 2)

    def errors(self, comparison: Comparison, mask: NDArray[np.bool_]) -> tuple[float, float]:
        """Return the chi2 of the data sets of a mask, predicted from the others without the terms and with them.

        Both are weighted by the inverse covariance of what the model without the terms predicts: noise, and the
        covariance of its coefficients (here by the matrix inversion lemma). So what the other data sets do not
        determine, such as a parabola over three temperatures of which one is left out, counts for neither.
        """
        data, model = comparison.data, comparison.model
        table = model.temperature
        if isinstance(table, LagrangeTable):
            temperature_c = data.at_sets(data.nodes.temperature_c(self.name))[mask]
            nodes_kept = tuple(
                node
                for node in table.nodes_c
                if not temperature_c.min() - EDGE_K <= node <= temperature_c.max() + EDGE_K
            )
            if len(nodes_kept) >= table.points and np.ptp(temperature_c) < NARROW_K:
                model = replace(model, temperature=LagrangeTable(nodes_kept, table.points))
        base, _, precision = base_rows(data, model, self.name)
        base = base / self.scale[:, :, None]
        in_fit, left_out = data.present & ~mask, data.present & mask
        axis_errors = []
        for rows, prior in (
            (base, precision),
            (np.concatenate([base, self.added], axis=2), np.concatenate([precision, self.precision])),
        ):
            values = _solved(rows[in_fit], self.y[in_fit], prior)
            residual = np.where(left_out, self.y - rows @ values, 0.0)
            followed = base[left_out] @ _solved(base[data.present], residual[data.present], precision)
            axis_errors.append(float(residual[left_out] @ (residual[left_out] - followed)))
        return axis_errors[0], axis_errors[1]


def _solved(rows: NDArray[np.float64], y: Array, precision: Array) -> Array:
    """Return the coefficients (k,) of columns (n, k), with a prior precision for each."""
    gram = rows.T @ rows + np.diag(precision)
    size = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    values, vectors = np.linalg.eigh(gram / np.outer(size, size))
    is_estimable = values > MIN_EIGENVALUE
    inner = vectors[:, is_estimable].T @ (rows.T @ y / size)
    return np.asarray(vectors[:, is_estimable] @ (inner / values[is_estimable]) / size)
