"""Noise floor of a recording: the least residual that any model can leave, whichever model is compared with it.

White noise is what the readings within a data set show. The drift between data sets is estimated beside a rich surface
of rate, temperature and surroundings, by restricted maximum likelihood, so that neither the error of a model nor the
number of its coefficients enters. Where the readings are unknown the scatter of repeats, or about the surface, stands
for both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from labctl.answers.fitted_model import CorrelationTimes
from labctl.fitting.data.channels import Channels
from labctl.fitting.data.levels import SAME_TEMPERATURE_C
from labctl.fitting.data.rich_surface import MIN_FREE, rich_surface, with_levels_of_temperature
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.drift_noise import Drift, Scatter
from labctl.fitting.numeric.drift_whitening import whitened
from labctl.fitting.numeric.least_squares import drift_beside

#: Data sets closer than this in rate (of the fastest) and temperature repeat each other.
REPEAT_RATE = 1e-3
REPEAT_TEMPERATURE_C = SAME_TEMPERATURE_C
REPEATS_NEEDED = 8
#: Of fewer data sets than this the drift is that of the data sheet, if it states one.
MIN_SETS = 16
#: Where the noise floor is from: white noise of the readings beside a drift that no data sets show.
BY_DATA_SHEET = "within data sets, and by the data sheet"
#: ... and from data sets at nearly the same rate and temperature, where there are no readings.
BY_REPEATS = "repeats"
#: Probability at which noise alone is taken for a law that no smooth function of temperature follows.
FALSE_ALARM = 1e-4


@dataclass(frozen=True)
class AxisNoise:
    """Noise of one axis' data-set means."""

    floor_dps: Array  #: (m,) standard deviation of each mean, white and drift together; NaN where it is not known
    white_dps: float | None  #: root mean square of the white part; None where the readings are not known
    drift: Drift
    is_drift_found: bool = True  #: by the scatter between data sets; False: its size is the data sheet's

    @property
    def correlation_times(self) -> CorrelationTimes:
        """The time constants of the drift, as JSON; a data sheet states none."""
        return correlation_times(self.drift) if self.is_drift_found else {"drift_tau_s": None}


@dataclass(frozen=True)
class NoiseFloor:
    """Noise of the data-set means of a recording, by axis, and where the figures are from."""

    axes: Mapping[str, AxisNoise]
    source: str  #: "within and between data sets", "within data sets and by the data sheet", "repeats", ... or "none"

    @property
    def rms_dps(self) -> float | None:
        """The noise of a data-set mean, root mean square over axes and data sets, deg/s; None where it is unknown."""
        every = np.concatenate([noise.floor_dps for noise in self.axes.values()] or [np.zeros(0)])
        return float(np.sqrt(np.mean(every**2))) if len(every) and np.all(np.isfinite(every)) else None


def noise_floor_of(channels: Channels, errors_dps: Mapping[str, Array], scatter: Mapping[str, Scatter]) -> NoiseFloor:
    """Return the noise of m data sets; it depends on nothing but the recording.

    `errors_dps` are output minus true rate, axis -> (m,); `scatter` is what the readings and the data sheet say, by
    axis.
    """
    surfaces = {axis: rich_surface(channels, axis) for axis in errors_dps}
    white = {axis: noise.white_var for axis, noise in scatter.items()}
    if all(values is not None for values in white.values()):
        return _with_known_white(channels, surfaces, errors_dps, scatter)
    residuals_dps = {axis: values - surfaces[axis] @ (surfaces[axis].T @ values) for axis, values in errors_dps.items()}
    m = len(channels)
    repeats = repeats_dps(channels, residuals_dps)
    if repeats is not None:
        return _of_scatter(m, dict.fromkeys(errors_dps, repeats), BY_REPEATS)
    about = {axis: _scatter_dps(residuals_dps[axis], surfaces[axis]) for axis in residuals_dps}
    noise = {axis: value for axis, value in about.items() if value is not None}
    if len(noise) < len(about):
        return _of_scatter(m, dict.fromkeys(errors_dps, np.nan), "none")
    return _of_scatter(m, noise, "scatter about a smooth surface")


def _with_known_white(
    channels: Channels,
    surfaces: Mapping[str, NDArray[np.float64]],
    errors_dps: Mapping[str, Array],
    scatter: Mapping[str, Scatter],
) -> NoiseFloor:
    stability = next(iter(scatter.values())).datasheet_drift_dps
    # beside fewer data sets the surface has too few columns for the laws of a gyro, which would pass for drift
    least = MIN_SETS if stability else MIN_FREE
    enough = all(len(surface) >= least and len(surface) - surface.shape[1] >= MIN_FREE for surface in surfaces.values())
    axes = {}
    for axis, surface in surfaces.items():
        noise = scatter[axis]
        assert noise.white_var is not None
        if channels.profile is not None:
            drift = _drift_of_many(surface, errors_dps[axis], noise)
        elif enough:
            drift = _drift(surface, with_levels_of_temperature(surface, channels, axis), errors_dps[axis], noise)
        else:
            drift = Drift(float(stability or 0.0), 1.0)  # the time constant is one to weight by, and not known
        floor = np.sqrt(noise.white_var + drift.drift_dps**2 + (drift.per_rate * noise.rate_dps) ** 2)
        is_found = enough or channels.profile is not None
        axes[axis] = AxisNoise(np.asarray(floor), float(np.sqrt(noise.white_var.mean())), drift, is_found)
    if enough:
        return NoiseFloor(axes, "within and between data sets")
    return NoiseFloor(axes, BY_DATA_SHEET if stability else "within data sets")


def _drift_of_many(surface: NDArray[np.float64], error_dps: Array, scatter: Scatter) -> Drift:
    """Return the drift of far more rows than columns: what the surface (m, k) leaves is taken as it is.

    The k directions that are then missing from it are a share k / m of all.
    """
    residual = error_dps - surface @ (surface.T @ error_dps)
    return drift_beside(np.full((len(residual), 1), 1.0 / np.sqrt(len(residual))), residual, scatter)


def _drift(surface: NDArray[np.float64], fuller: NDArray[np.float64], error_dps: Array, scatter: Scatter) -> Drift:
    """Return the drift beside a surface (m, k), or a fuller one where an F-test at the first drift asks for it."""
    first = drift_beside(surface, error_dps, scatter)
    k, k_fuller = surface.shape[1], fuller.shape[1]
    more, free = k_fuller - k, len(surface) - k_fuller
    if more == 0 or scatter.white_var is None:
        return first
    (rows,), _ = whitened(scatter, [first], scatter.white_var, np.column_stack([fuller, error_dps]))
    # the last column of the triangle: what the surface takes of the data, what the levels take, and what is left
    triangle: NDArray[np.float64] = np.asarray(np.linalg.qr(rows, mode="r"))
    reduced = triangle[:, -1] ** 2
    explained, unexplained = float(np.sum(reduced[k:k_fuller])), float(np.sum(reduced[k_fuller:]))
    if fdtrc(more, free, explained / more / max(unexplained / free, 1e-300)) > FALSE_ALARM:
        return first
    return drift_beside(fuller, error_dps, scatter)


def _of_scatter(m: int, scatter_dps: Mapping[str, float], source: str) -> NoiseFloor:
    return NoiseFloor(
        {axis: AxisNoise(np.full(m, value), None, Drift(0.0, 1.0)) for axis, value in scatter_dps.items()},
        source,
    )


def _scatter_dps(residual: Array, surface: NDArray[np.float64]) -> float | None:
    freedom = len(residual) - surface.shape[1]
    return float(np.sqrt(residual @ residual / freedom)) if freedom >= MIN_FREE else None


def correlation_times(drift: Drift) -> CorrelationTimes:
    """Return the time constants of a drift that was found, as JSON."""
    if drift.drift_dps <= 0:
        return {"drift_tau_s": None}
    if drift.shortest_tau_s is None:
        return {"drift_tau_s": drift.tau_s}
    return {"drift_tau_s": drift.tau_s, "drift_shortest_tau_s": drift.shortest_tau_s}


def repeats_dps(channels: Channels, residual: Mapping[str, Array]) -> float | None:
    """Return the noise of one data set from pairs that repeat a rate and a temperature; None when they are too few."""
    rate = channels.table_rate_dps()
    temperature_c = np.asarray(channels["temperature_c"], dtype=np.float64)
    near_rate = REPEAT_RATE * max(float(np.abs(rate).max()), 1e-9)
    order = np.lexsort((temperature_c, np.round(rate / near_rate)))
    first, second = order[:-1], order[1:]
    close = (np.abs(rate[first] - rate[second]) <= near_rate) & (
        np.abs(temperature_c[first] - temperature_c[second]) <= REPEAT_TEMPERATURE_C
    )
    position = np.asarray(channels["position"])
    close &= position[first] == position[second]
    if close.sum() < REPEATS_NEEDED:
        return None
    differences = np.concatenate([(values[first] - values[second])[close] for values in residual.values()])
    return float(np.sqrt(np.mean(differences**2) / 2))
