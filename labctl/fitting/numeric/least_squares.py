"""Generalised least squares by QR in scaled columns, averaged over what the noise may be.

Raw Vandermonde columns of rate and temperature have a condition of 1e10; columns centred in temperature and scaled to
unit length have about 1e1 to 1e2 (papers' trap O5), and no normal equations are formed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.fitting.numeric import drift_noise
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.drift_noise import Drift, Scatter

#: Scaled columns are taken as linearly dependent below this ratio of singular values.
RANK_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Solution:
    """Coefficients (k,), their covariance (k, k), residuals (m,) and the noise that weighted the data."""

    values: Array
    covariance: NDArray[np.float64]
    residual: Array
    white_dps: float | None  #: of a data-set mean; None when only the total is known
    drift: Drift
    scale: float  #: factor on the covariance estimated from the residuals; 1 where the white noise is known;
    #: NaN, as the covariance then is, where neither the residuals nor the readings say anything about noise


@dataclass(frozen=True)
class _Point:
    """The fit at one point of the noise grid."""

    drift: Drift
    values: Array
    covariance: NDArray[np.float64]
    log_evidence: float
    scale: float


def rank_of(design: NDArray[np.float64]) -> int:
    """Return the rank of a design (m, k) in scaled columns."""
    norms = np.linalg.norm(design, axis=0)
    singular = np.linalg.svd(design / np.where(norms > 0, norms, 1.0), compute_uv=False)
    return int(np.sum(singular > RANK_TOLERANCE * max(singular[0], 1e-300)))


def solve(design: NDArray[np.float64], y: Array, scatter: Scatter, drift: Drift | None = None) -> Solution:
    """Fit y (m,) by design (m, k), weighted by the inverse of its noise; `drift` fixes the noise instead of a grid.

    Raises NotEnoughData when the columns are linearly dependent or there are fewer rows than columns.
    """
    m, k = design.shape
    if m < k or rank_of(design) < k:
        raise NotEnoughData(
            f"{m} data sets at these rates and temperatures determine {min(m, rank_of(design))} of {k} coefficients"
        )
    if drift is not None:
        return _collect(_at(design, y, scatter, [drift]), design, y, scatter)
    (ordinary,) = _at(design, y, scatter, [Drift(0.0, 1.0)])
    unexplained = _unexplained(design, y, scatter, ordinary)
    points = _at(design, y, scatter, drift_noise.grid(scatter, unexplained))
    growing = _per_rate(design, y, scatter, max(points, key=lambda p: p.log_evidence))
    if growing > 0:
        more = _at(design, y, scatter, drift_noise.grid(scatter, unexplained, growing))
        if max(p.log_evidence for p in more) > max(p.log_evidence for p in points) + 3.0:
            points = more
    return _collect(points, design, y, scatter)


def _at(design: NDArray[np.float64], y: Array, scatter: Scatter, drifts: Sequence[Drift]) -> list[_Point]:
    """Return the weighted fit and its restricted log likelihood at each drift."""
    white = scatter.white_var if scatter.white_var is not None else np.ones(len(y))
    m, k = design.shape
    rows, log_dets = drift_noise.whitened(scatter, drifts, white, np.column_stack([design, y]))
    norms = np.linalg.norm(rows[:, :, :k], axis=1)
    rows[:, :, :k] /= norms[:, None, :]
    # the triangle of columns and data together holds the data's projection on the columns, and below it what is left
    triangles: NDArray[np.float64] = np.asarray(np.linalg.qr(rows, mode="r"))
    r, projected = triangles[:, :k, :k], triangles[:, :k, k:]
    identity = np.broadcast_to(np.eye(k), r.shape)
    solved = np.linalg.solve(r, np.concatenate([projected, identity], axis=2)) / norms[:, :, None]
    chi2 = np.sum(triangles[:, k:, k] ** 2, axis=1)
    log_dets = log_dets + 2 * np.log(np.abs(np.diagonal(r, axis1=1, axis2=2)) * norms).sum(axis=1)
    return [
        _point(drift, one, float(c), float(log_det), drift_noise.log_prior(scatter, drift), freedom=max(m - k, 1),
               known=scatter.white_var is not None)
        for drift, one, c, log_det in zip(drifts, solved, chi2, log_dets, strict=True)
    ]  # fmt: skip


def _point(
    drift: Drift, solved: NDArray[np.float64], chi2: float, log_det: float, log_prior: float, *, freedom: int,
    known: bool,
) -> _Point:  # fmt: skip
    """Return the fit at one drift: `solved` (k, 1 + k) holds the coefficients and a square root of their covariance."""
    values, inverse = solved[:, 0], solved[:, 1:]
    # what no noise explains is the model's fault, and makes its coefficients that much less certain
    scale = max(chi2 / freedom, 1.0) if known else max(chi2, 1e-300) / freedom
    fit_term = chi2 if known else freedom * np.log(max(chi2, 1e-300))
    return _Point(drift, values, inverse @ inverse.T * scale, -0.5 * (log_det + fit_term) + log_prior, scale)


def _unexplained(design: NDArray[np.float64], y: Array, scatter: Scatter, fit: _Point) -> float:
    """Return the scatter that white noise does not explain, deg/s; in units of the white part when that is unknown."""
    residual = y - design @ fit.values
    freedom = max(len(y) - design.shape[1], 1)
    total = float(residual @ residual) / freedom
    largest = scatter.largest_drift_dps / max(drift_noise.DRIFT_SIZES)
    if scatter.white_var is None:
        return float(min(1.0, largest / np.sqrt(max(total, 1e-300))))
    unexplained = np.sqrt(max(total - scatter.white_var.mean(), 0.01 * scatter.white_var.mean(), 1e-24))
    return float(min(unexplained, largest))


def _per_rate(design: NDArray[np.float64], y: Array, scatter: Scatter, fit: _Point) -> float:
    """Return a robust first guess of the noise that grows with rate: a part of the table's, not of the gyro's."""
    residual = np.abs(y - design @ fit.values)
    rate = np.abs(scatter.rate_dps)
    fast = rate > np.quantile(rate, 2 / 3)
    slow = rate < np.quantile(rate, 1 / 3)
    if fast.sum() < 8 or slow.sum() < 8:
        return 0.0
    high, low = 1.4826 * np.median(residual[fast]), 1.4826 * np.median(residual[slow])
    excess = np.sqrt(max(high**2 - low**2, 0.0)) / max(float(np.median(rate[fast])), 1e-12)
    return float(excess if scatter.white_var is not None else excess / np.sqrt(max(fit.scale, 1e-300)))


def _collect(points: list[_Point], design: NDArray[np.float64], y: Array, scatter: Scatter) -> Solution:
    """Average the fits over the noise grid by their evidence (law of total variance)."""
    evidence = np.array([point.log_evidence for point in points])
    weights = np.exp(evidence - evidence.max())
    weights /= weights.sum()
    values = sum(w * point.values for w, point in zip(weights, points, strict=True))
    covariance = sum(
        w * (point.covariance + np.outer(point.values - values, point.values - values))
        for w, point in zip(weights, points, strict=True)
    )
    best = points[int(np.argmax(weights))]
    size = np.sqrt(sum(w * p.scale * p.drift.drift_dps**2 for w, p in zip(weights, points, strict=True)))
    white = None if scatter.white_var is None else float(np.sqrt(scatter.white_var.mean()))
    # as many coefficients as data sets leave no residuals, and so nothing to be uncertain by
    blind = np.nan if white is None and design.shape[0] == design.shape[1] else 1.0
    return Solution(
        np.asarray(values),
        np.asarray(covariance) * blind,
        y - design @ np.asarray(values),
        white,
        Drift(float(size), best.drift.tau_s, best.drift.per_rate * float(np.sqrt(best.scale))),
        best.scale * blind,
    )
