"""Residuals of a recording beside the base, data set by data set, and where they are more than noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from labctl.answers.criticism import FailingRange, WorstDataSet
from labctl.fitting.criticism.channel_functions import smooth_channels
from labctl.fitting.criticism.evidence.elimination import stack
from labctl.fitting.criticism.evidence.noise_grid import factors
from labctl.fitting.criticism.model_comparison import Comparison
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.data.noise_floor import NoiseFloor
from labctl.fitting.data.temperature.levels import ONE_LEVEL_SPAN_C
from labctl.fitting.numeric.arrays import Array, over

#: Bins of a channel over which residuals are averaged.
BINS = 8
#: A bin is reported from this z on, and at most this many bins are.
MIN_Z = 3.0
LINES = 12
#: Temperatures went one way only when they came back by less than this share of their span.
BACK_SHARE = 0.25


@dataclass(frozen=True)
class Residuals:
    """One axis: what is left of each data set's mean, the noise floor, and chi2 over the noise."""

    means: Array  #: (m,) deg/s
    floor_dps: Array  #: (m,) noise of each mean, white and drift together
    chi2: float  #: of all residual coordinates over their noise
    freedom: int  #: degrees of freedom of chi2

    @property
    def score(self) -> Array:
        """Residual over floor, (m,)."""
        return over(self.means, self.floor_dps)


def residuals_of(
    comparison: Comparison, floor: NoiseFloor, fitted: Mapping[str, Array] | None = None
) -> dict[str, Residuals]:
    """Return the residuals of each axis beside the base, with the noise floor of the recording.

    `fitted` are those of a fit of the same model, axis -> (m,): where they are given they are shown, so that the RMS of
    what is shown is the error that the fit states.
    """
    m = len(comparison.data)
    floors = {axis: noise.floor_dps for axis, noise in floor.axes.items()}
    if comparison.data.nodes.profile is not None:  # the floor of a fit is that of a window, and a row here is a piece
        floors = {
            axis: np.sqrt(comparison.white_var[axis] + axis_residuals.best.noise.size_dps**2)
            for axis, axis_residuals in comparison.axes.items()
        }
    elif any(len(values) != m for values in floors.values()):  # long data sets in other pieces
        floors = {axis: np.full(m, np.sqrt(np.mean(values**2))) for axis, values in floors.items()}
    axis_residuals = {axis: _axis(comparison, axis, floors[axis]) for axis in comparison.axes}
    if fitted is None or any(len(values) != m for values in fitted.values()):
        return axis_residuals
    return {axis: replace(residuals, means=fitted[axis]) for axis, residuals in axis_residuals.items()}


def _axis(comparison: Comparison, axis: str, floor_dps: Array) -> Residuals:
    data, design, axis_comparison = comparison.data, comparison.designs[axis], comparison.axes[axis]
    y = data.error_dps(axis)
    noise, white = axis_comparison.best.noise, comparison.white_var[axis]
    blocks, _ = factors(noise, white, design.t_s, design.run)
    together = np.concatenate([design.base, y[:, :, None]], axis=2)
    means = np.empty_like(together[0])
    for rows, factor in blocks:
        means[rows] = solve_triangular(factor, together[0][rows], lower=True, check_finite=False)
    other = stack(together, comparison.scales[axis], design.present)
    prior = np.diag(np.sqrt(design.precision))[design.precision > 0]
    prior = np.column_stack([prior, np.zeros(len(prior))]) if len(prior) else np.zeros((0, means.shape[1]))
    whole = np.vstack([means, other, prior])
    size = np.maximum(np.linalg.norm(whole[:, :-1], axis=0), 1e-300)
    solution, *_ = np.linalg.lstsq(whole[:, :-1] / size, whole[:, -1], rcond=1e-10)
    return Residuals(
        (y - design.base @ (solution / size))[0],
        floor_dps,
        float(np.sum((whole[:, -1] - whole[:, :-1] @ (solution / size)) ** 2)),
        axis_comparison.rows - axis_comparison.base_columns,
    )


def where_it_fails(data: ReducedRecording, axis_residuals: Mapping[str, Residuals]) -> list[FailingRange]:
    """Return the ranges of channels in which the mean residual is far from 0, worst first."""
    failing_ranges: list[FailingRange] = []
    for axis, residuals in axis_residuals.items():
        for name, nodes in smooth_channels(data, axis).items():
            values = data.at_sets(nodes)
            for low, high, rows in _bins(values):
                score = residuals.score[rows]
                z = float(abs(score.mean()) * np.sqrt(len(score)))
                if z >= MIN_Z:
                    rms = float(np.sqrt(np.mean(residuals.means[rows] ** 2)))
                    failing_ranges.append(
                        {"axis": axis, "channel": name, "from": low, "to": high, "rms_dps": rms, "z": z}
                    )
    return sorted(failing_ranges, key=lambda line: -line["z"])[:LINES]


def _bins(values: Array) -> list[tuple[float, float, NDArray[np.int64]]]:
    distinct = np.unique(np.round(values, 6))
    edges = np.quantile(distinct, np.linspace(0, 1, min(BINS, len(distinct)) + 1))
    which = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    return [
        (float(values[rows].min()), float(values[rows].max()), rows)
        for k in range(len(edges) - 1)
        if len(rows := np.flatnonzero(which == k)) >= 4
    ]


def has_one_rising_leg(data: ReducedRecording) -> bool:
    """Return whether a recording's temperatures went one way only: then temperature and time are one variable."""
    if "t_s" not in data.nodes:
        return False
    temperature_c = data.at_sets(data.nodes.temperature_c(data.info.axes[0]))
    order = np.argsort(data.at_sets(np.asarray(data.nodes["t_s"], dtype=np.float64)), kind="stable")
    steps, span = np.diff(temperature_c[order]), float(np.ptp(temperature_c))
    back = min(float(-steps[steps < 0].sum()), float(steps[steps > 0].sum()))
    return span > ONE_LEVEL_SPAN_C and back < BACK_SHARE * span


def worst_data_sets(
    data: ReducedRecording, axis_residuals: Mapping[str, Residuals], most: int = 10
) -> list[WorstDataSet]:
    """Return the data sets with the largest mean residual over its floor, at most `most`, worst first."""
    worst: list[WorstDataSet] = []
    for axis, residuals in axis_residuals.items():
        order = np.argsort(-np.abs(residuals.score))[:most]
        worst.extend(
            WorstDataSet(
                axis=axis,
                dataset=int(data.dataset[i]),
                residual_dps=float(residuals.means[i]),
                over_floor=float(residuals.score[i]),
            )
            for i in order
        )
    return sorted(worst, key=lambda line: -abs(line["over_floor"]))[:most]
