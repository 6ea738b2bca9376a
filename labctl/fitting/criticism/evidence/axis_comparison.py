"""Scatter of the coordinates of one axis: variance of the means and scale of the other coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.evidence.bayes_factors import AxisEvidence, evidence, means_by_noise
from labctl.fitting.criticism.evidence.design import Design
from labctl.fitting.criticism.evidence.elimination import MeansByNoise
from labctl.fitting.criticism.evidence.gains import solve_option
from labctl.fitting.criticism.evidence.noise_grid import Noise, noise_grid
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.numeric.arrays import Array

#: From this evidence on, the scatter of the coordinates is estimated again without what the leader explains.
REESTIMATE_FROM = 6.0
ROBUST = 1.4826
#: Least variance of a mean, (deg/s)^2: data without any scatter, as formulas make them, must not divide by zero.
LEAST_VAR = 1e-20


@dataclass(frozen=True)
class AxisComparison:
    """Evidence on one axis with the scatter that it was computed with."""

    evidence: AxisEvidence
    white_var: Array  #: (m,) variance of the means besides the drift, (deg/s)^2
    scale: NDArray[np.float64]  #: (R, m) standard deviation of the coordinates besides the means, deg/s


def compare_axis(data: ReducedRecording, design: Design, axis: str) -> AxisComparison:
    """Return the evidence for every option of one axis, with the scatter estimated from the data."""
    y = data.error_dps(axis)
    white, noises = _noise_of(data, design, y, axis)
    explained = np.zeros_like(y)
    means: MeansByNoise | None = None
    for estimate in range(2):
        scale = _scales(design, y, white, explained)
        white_now = white + _growing(data, design, y, white, explained)
        if means is None or not np.array_equal(white_now, means.white_var):
            means = means_by_noise(design, y, white_now, noises)
        found = evidence(design, y, means, scale, int(design.present.sum()))
        leader = int(np.argmax(found.log_bf)) if len(found.log_bf) else -1
        if estimate == 1 or leader < 0 or found.log_bf[leader] < REESTIMATE_FROM:
            break
        explained = _explained(design, found, leader)
    return AxisComparison(found, white_now, scale)


def _explained(design: Design, found: AxisEvidence, option: int) -> NDArray[np.float64]:
    """Return what an option explains, (R, m)."""
    coefficients, _ = solve_option(found.best, found.slices[option])
    return np.asarray(design.options[option].rows @ coefficients)


def _noise_of(data: ReducedRecording, design: Design, y: NDArray[np.float64], axis: str) -> tuple[Array, list[Noise]]:
    """Return the white variance of each mean, (m,) (deg/s)^2, and the drifts to average over."""
    stability = data.info.stability_dps
    known = data.white_var
    white = known[axis] if known is not None else np.full(len(data), max(_floor_squared(design, y), LEAST_VAR))
    level = float(np.sqrt(np.median(white)))
    return white, noise_grid(data.info.technology or "", stability, level, data.instability_dps(axis))


def _floor_squared(design: Design, y: NDArray[np.float64]) -> float:
    """Return the variance of a mean, (deg/s)^2, without known readings: from the residual of a rich smooth model."""
    rich = [design.base[0], *(o.rows[0] for o in design.options if o.smooth)]
    columns = np.concatenate(rich, axis=1)
    columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    u = u[:, s > 1e-6 * s[0]]
    left = y[0] - u @ (u.T @ y[0])
    return float((ROBUST * np.median(np.abs(left))) ** 2 * len(left) / max(len(left) - u.shape[1], 1))


def _base_residual(design: Design, y: NDArray[np.float64], white: Array) -> NDArray[np.float64]:
    """Return what the base leaves of y (R, m) when its means are fitted with equal drift: good enough for scatter."""
    weight = 1.0 / np.sqrt(white)
    prior = np.diag(np.sqrt(design.precision))[design.precision > 0]
    columns = np.vstack([design.base[0] * weight[:, None], prior])
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    wanted = np.concatenate([y[0] * weight, np.zeros(len(prior))])
    solution, *_ = np.linalg.lstsq(columns / size, wanted, rcond=1e-9)
    return np.asarray(y - design.base @ (solution / size))


def _scales(
    design: Design, y: NDArray[np.float64], white: Array, explained: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the standard deviation of each coordinate (R, m): robust, one per kind, never below white noise."""
    residual = _base_residual(design, y - explained, white)
    scale = np.repeat(np.sqrt(white)[None, :], len(y), axis=0)
    for k in range(1, len(y)):
        here = design.present[k]
        if here.sum() < 8:
            continue
        values = residual[k, here] / scale[k, here]
        spread = ROBUST * float(np.median(np.abs(values - np.median(values))))
        scale[k] *= max(spread, 1.0)
    return scale


def _growing(
    data: ReducedRecording, design: Design, y: NDArray[np.float64], white: Array, explained: NDArray[np.float64]
) -> Array:
    """Return the variance of means that grows with the table's rate, (m,): scatter between sets of one rate."""
    rate = data.at_sets(data.nodes.table_rate_dps())
    residual = _base_residual(design, y - explained, white)[0]
    centred = residual.copy()
    position = np.asarray(data.nodes["position"]).reshape(len(data), -1)[:, 0]
    for there in np.unique(position):
        for value in np.unique(np.round(rate[position == there], 2)):
            same = (position == there) & (np.round(rate, 2) == value)
            centred[same] -= np.median(residual[same])
    speed = np.abs(rate)
    fast, slow = speed > np.quantile(speed, 2 / 3), speed < np.quantile(speed, 1 / 3)
    if fast.sum() < 12 or slow.sum() < 12:
        return np.zeros(len(rate))
    high, low = (ROBUST * float(np.median(np.abs(centred[part]))) for part in (fast, slow))
    if high < 1.5 * low:
        return np.zeros(len(rate))
    return np.asarray((high**2 - low**2) * (rate / float(np.median(speed[fast]))) ** 2)
