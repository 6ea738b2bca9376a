"""Response of the outputs to the table in one position: gain, and the deviation of each data set from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.recording.sanity.summary import Summary

#: Rates that differ by less than this in all, deg/s, do not determine a gain.
MIN_SPAN_DPS = 1.0
#: Two data sets alone determine a gain from this difference of rates on, deg/s.
TWO_POINT_SPAN_DPS = 20.0
#: Data sets per column from which temperature enters, and the span of temperature, K.
SETS_PER_COLUMN, MIN_WARMTH_K = 3, 1.0
ROUNDS, MIN_RESIDUAL = 40, 1e-6
ROBUST = 1.4826


@dataclass(frozen=True)
class Response:
    """One output while the unit turns in one position."""

    position: str
    output: str
    rows: NDArray[np.bool_]  #: (m,) the data sets of the position
    gain: float  #: change of the output per deg/s of the table
    u: float  #: standard uncertainty of the gain
    scatter_dps: float  #: usual distance of a mean from the line
    residual_dps: NDArray[np.float64]  #: of the position's data sets, deg/s

    @property
    def is_known(self) -> bool:
        """Whether the gain is known well enough to be judged."""
        return self.u < 0.05 or self.u < 0.05 * abs(self.gain)


def responses(summary: Summary) -> dict[str, dict[str, Response]]:
    """Return position -> output axis -> response, where the table's rates determine one."""
    position = np.asarray(summary["position"]).astype(np.str_)
    by_axis: dict[str, dict[str, Response]] = {}
    for up_axis in dict.fromkeys(position.tolist()):
        rows = position == up_axis
        rate = np.asarray(summary["table_rate_dps"], dtype=np.float64)[rows]
        span = float(np.ptp(rate))
        if span < MIN_SPAN_DPS or (len(rate) == 2 and span < TWO_POINT_SPAN_DPS):
            continue
        fast = float(np.abs(rate).max())
        design = _design(rate / fast, np.asarray(summary["temperature_c"], dtype=np.float64)[rows])
        by_axis[up_axis] = {
            axis: _response(up_axis, axis, rows, design, summary.of_axis("mean", axis)[rows], fast)
            for axis in summary.info.axes
        }
    return by_axis


def _design(share: NDArray[np.float64], temperature_c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the columns of a mean, (n, k), for rates as shares of the fastest (n,) and temperatures (n,).

    The rate comes first, then a constant, and temperature where there are data for it.
    """
    columns = [share, np.ones_like(share)]
    span = float(np.ptp(temperature_c)) if np.isfinite(temperature_c).all() else 0.0
    if span > MIN_WARMTH_K:
        u = 2.0 * (temperature_c - temperature_c.mean()) / span
        more = [u, u * share, u**2, u**3]
        columns += more[: max(len(share) // SETS_PER_COLUMN - len(columns), 0)]
    return np.column_stack(columns)


def _response(
    position: str, axis: str, rows: NDArray[np.bool_], design: NDArray[np.float64], output: NDArray[np.float64],
    fast_dps: float,
) -> Response:  # fmt: skip
    residual, coefficients = _least_absolute(design, output)
    n, k = design.shape
    scatter = ROBUST * float(np.median(np.abs(residual))) * np.sqrt(n / max(n - k, 1))
    length = float(np.sqrt(np.sum((design[:, 0] - design[:, 0].mean()) ** 2)))
    gain, u = float(coefficients[0]) / fast_dps, scatter / max(length, 1e-12) / fast_dps
    return Response(position, axis, rows, gain, u, scatter, residual)


def _least_absolute(
    design: NDArray[np.float64], output: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return residuals (n,) and coefficients (k,) with the least sum of absolute residuals, which outliers do not move.

    By iteratively reweighted least squares.
    """
    weight = np.ones(len(output))
    least = MIN_RESIDUAL * max(float(np.abs(output).max()), 1e-9)
    for _ in range(ROUNDS):
        root = np.sqrt(weight)
        coefficients, *_ = np.linalg.lstsq(design * root[:, None], output * root, rcond=1e-9)
        residual = output - design @ coefficients
        weight = 1.0 / np.maximum(np.abs(residual), least)
        weight /= weight.max()
    return residual, np.asarray(coefficients, dtype=np.float64)
