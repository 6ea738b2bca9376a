"""Formulas of the figures of the pages, written here from the documentation: NumPy only, nothing of labctl."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

Array = np.ndarray
#: The error after a full turn is stated from this rate on; below the other one the table is at rest, deg/s.
LEAST_TURN_DPS, AT_REST_DPS = 5.0, 0.01


@dataclass(frozen=True)
class Law:
    """A version: output = rate + bias + (scale factor and misalignment) rate, each a polynomial of the temperature."""

    axes: tuple[str, ...]
    reference_c: float
    coefficients: Mapping[str, Mapping[str, float]]  #: axis -> name -> value
    names: Mapping[str, Sequence[str]]  #: axis -> coefficients of the covariance, in its order
    covariance: Mapping[str, Array]

    @staticmethod
    def of(document: Mapping[str, Any]) -> Law:
        """Read the document of a version."""
        model, stored = document["model"], document["coefficients"]
        return Law(
            tuple(stored), model["reference"]["temperature_c"],
            {axis: {name: each["value"] for name, each in own.items()} for axis, own in stored.items()},
            {axis: each["names"] for axis, each in model["axes"].items()},
            {axis: np.array(each["covariance"]) for axis, each in model["axes"].items()},
        )  # fmt: skip

    @property
    def temperature_degree(self) -> int:
        """The highest power of the temperature."""
        powers = [name.rsplit("_t", 1)[-1] for own in self.names.values() for name in own if "_t" in name]
        return max((int(each) for each in powers if each.isdigit()), default=0)

    def at(self, temperature_c: Array) -> tuple[Array, Array]:
        """Return bias (n, axes) and the matrix (n, axes, axes) from rates to outputs."""
        n, k = len(temperature_c), len(self.axes)
        bias, matrix = np.zeros((n, k)), np.tile(np.eye(k), (n, 1, 1))
        for row, axis in enumerate(self.axes):
            for name, value in self.coefficients[axis].items():
                stem, column, factor = self._place(name, row, temperature_c)
                if stem == "bias":
                    bias[:, row] += value * factor
                else:
                    matrix[:, row, column] += value * factor
        return bias, matrix

    def _place(self, name: str, row: int, temperature_c: Array) -> tuple[str, int, Array]:
        stem, power = name.rsplit("_t", 1) if name.rsplit("_t", 1)[-1].isdigit() else (name, "0")
        factor = (temperature_c - self.reference_c) ** int(power)
        if stem in {"bias", "scale_factor"}:
            return stem, row, factor
        if stem.startswith("misalignment_"):
            return stem, self.axes.index(stem[-1]), factor
        raise ValueError(f"{name}: a coefficient of a model that is not written here; write it, or leave its unit out")

    def columns(self, axis: str, rate_dps: Array, temperature_c: Array) -> Array:
        """Return what each coefficient of an axis is multiplied with, (n, k), at true rates (n, axes)."""
        places = [self._place(name, self.axes.index(axis), temperature_c) for name in self.names[axis]]
        return np.column_stack([
            factor * (1.0 if stem == "bias" else rate_dps[:, column]) for stem, column, factor in places
        ])  # fmt: skip

    def error(self, rate_dps: Array, temperature_c: Array) -> Array:
        """Return the error (n, axes) of outputs at true rates (n, axes), deg/s."""
        bias, matrix = self.at(temperature_c)
        return bias + np.einsum("nij,nj->ni", matrix, rate_dps) - rate_dps

    def corrected(self, output_dps: Array, temperature_c: Array) -> Array:
        """Return the rates (n, axes) of outputs (n, axes), deg/s."""
        bias, matrix = self.at(temperature_c)
        return np.linalg.solve(matrix, (output_dps - bias)[:, :, None])[:, :, 0]

    def u_of_fit(self, rates_dps: Array, temperature_c: float, correlation: Array) -> Array:
        """Return u of each corrected rate by the covariance of the fit, deg/s, at a rate about x, y and z.

        `correlation` is that of the errors of the outputs, (axes, axes).
        """
        warm, own = np.array([temperature_c]), rates_dps[["xyz".index(axis) for axis in self.axes]][None, :]
        inverse = np.linalg.inv(self.at(warm)[1][0])
        slopes = {axis: self.columns(axis, own, warm)[0] for axis in self.axes}
        u = np.sqrt([slopes[axis] @ self.covariance[axis] @ slopes[axis] for axis in self.axes])
        return np.sqrt(np.diag(inverse @ (np.outer(u, u) * correlation) @ inverse.T))


def centres(values: Array, level: Array) -> Array:
    """Return for each value the mean of those that a page puts into the same cell."""
    which = np.unique(level, return_inverse=True)[1]
    return (np.bincount(which, values) / np.bincount(which))[which]


def ranks(level: Array) -> Array:
    """Return the number of the level of each value, from 0 rising."""
    return np.unique(level, return_inverse=True)[1]


def full_turns(error_dps: Array, rate_dps: Array, temperature_c: Array, position: Array, turning: Array) -> Array:
    """Return the error after a turn of 360 deg, deg, less the error at rest in the same position; NaN below 5 deg/s."""
    still = np.abs(rate_dps) < AT_REST_DPS
    bias = np.full(len(error_dps), np.nan)
    for up in np.unique(position):
        here = position == up
        rest = still & here if np.any(still & here) else still
        if np.any(rest):
            warm, which = np.unique(temperature_c[rest], return_inverse=True)
            bias[here] = np.interp(temperature_c[here], warm, np.bincount(which, error_dps[rest]) / np.bincount(which))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(
            turning & (np.abs(rate_dps) >= LEAST_TURN_DPS), (error_dps - bias) * 360 / np.abs(rate_dps), np.nan
        )


def straight_line(values_dps: Array, rate_dps: Array) -> tuple[Array, Array]:
    """Return offset and slope of values over rates by least squares, and their standard uncertainties."""
    found, u, _ = _least_squares(np.column_stack([np.ones(len(rate_dps)), rate_dps]), values_dps)
    return found, u


def slope_over(temperature_c: Array, values: Array, u: Array) -> tuple[float, float]:
    """Return the slope of figures over temperature, and its u: by their scatter or by their own u, the larger one."""
    columns = np.column_stack([np.ones(len(values)), temperature_c - temperature_c.mean()])
    carried = np.sqrt(np.sum((columns[:, 1] * u) ** 2)) / np.sum(columns[:, 1] ** 2)
    if len(values) == 2:
        return float(np.diff(values)[0] / np.diff(temperature_c)[0]), float(carried)
    found, u_scatter, _ = _least_squares(columns, values)
    return float(found[1]), float(max(u_scatter[1], carried))


def asymmetry(output_dps: Array, rate_dps: Array) -> tuple[float, float]:
    """Return the slope at positive rates less that at negative ones, over their mean, ppm, and its u."""
    (_, mean, difference), u, _ = _least_squares(
        np.column_stack([np.ones(len(rate_dps)), rate_dps, np.abs(rate_dps) / 2]), output_dps
    )
    return 1e6 * difference / mean, 1e6 * u[2] / mean


def nonlinearity(output_dps: Array, rate_dps: Array, white_var: Array | None) -> list[float]:
    """Return the largest deviation from the straight line over the fastest rate, ppm, and its u if noise is known."""
    found, _, left = _least_squares(np.column_stack([np.ones(len(rate_dps)), rate_dps]), output_dps)
    at = int(np.argmax(np.abs(left)))
    sizes = [abs(left[at])] if white_var is None else [abs(left[at]), np.sqrt(white_var[at])]
    return [float(1e6 * size / (found[1] * np.abs(rate_dps).max())) for size in sizes]


def _least_squares(columns: Array, values: Array) -> tuple[Array, Array, Array]:
    inverse = np.linalg.inv(columns.T @ columns)
    found = inverse @ columns.T @ values
    left = values - columns @ found
    return found, np.sqrt(np.diag(inverse) * (left @ left) / (len(left) - columns.shape[1])), left


def waves(angle_rad: Array, turned_rad: Array, position: Array, axis: str) -> list[Array]:
    """Return the means of a cosine and a sine of the table's angle over each data set, for each position.

    `angle_rad` is where the table was at the beginning, `turned_rad` how far it went. An axis along that of the table
    has none.
    """
    half = turned_rad / 2
    shrink = np.sinc(half / np.pi)
    middle = angle_rad + half
    return [
        np.where(position == up, of(middle) * shrink, 0.0)
        for up in np.unique(position) if up[-1] != axis for of in (np.cos, np.sin)
    ]  # fmt: skip


def in_bins(values: Array, n: Sequence[int]) -> dict[str, Array]:
    """Return least, largest and mean of readings in order of time that a figure puts together, n in each bin."""
    parts = np.split(values, np.cumsum(n)[:-1])
    return {name: np.array([of(part) for part in parts]) for name, of in
            (("min", np.min), ("max", np.max), ("mean", np.mean))}  # fmt: skip


def bins_of_trace(t_s: Array, begins: Array, window: tuple[float, float], points: int) -> list[int]:
    """Return how many readings are in each bin of a trace, from the readings where a window is short, else envelopes.

    `begins` is where each data set begins. Bins are of equal time. A data set has 64 envelopes, or one for 128
    readings, which belong to the bin of their mean time.
    """
    low, high = window
    lengths = np.diff(begins)
    envelopes = [min(max(64, n // 128), 4096, n) for n in lengths.tolist()]
    inside = np.clip(
        (np.minimum(high, t_s[begins[1:] - 1]) - np.maximum(low, t_s[begins[:-1]]))
        / np.maximum(t_s[begins[1:] - 1] - t_s[begins[:-1]], 1e-9), 0, 1,
    )  # fmt: skip
    times, readings = t_s, np.ones(len(t_s), dtype=int)
    if inside @ envelopes >= points:
        edges = [first + np.linspace(0, n, k + 1).astype(int)[:-1]
                 for first, n, k in zip(begins[:-1].tolist(), lengths.tolist(), envelopes, strict=True)]  # fmt: skip
        parts = np.split(t_s, np.concatenate(edges)[1:])
        times, readings = np.array([part.mean() for part in parts]), np.array([len(part) for part in parts])
    kept = (times >= low) & (times <= high)
    which = np.minimum(((times[kept] - low) / (high - low) * points).astype(int), points - 1)
    return [int(n) for n in np.bincount(which, readings[kept]) if n]


def allan_deviation(values: Array, seconds: float, tau_s: Sequence[float]) -> Array:
    """Return the overlapping Allan deviation of evenly spaced readings: clusters of m begin at each reading."""
    total = np.concatenate([[0.0], np.cumsum(values - values.mean())])
    found = []
    for tau in tau_s:
        m = round(tau / seconds)
        means = (total[m:] - total[:-m]) / m
        found.append(np.sqrt(0.5 * np.mean((means[m:] - means[:-m]) ** 2)))
    return np.array(found)


def alignment_deg(slopes: Array, u: Array) -> tuple[Array, Array]:
    """Return misalignment about x, y, z and orthogonality of xy, xz, yz, (6,) deg, by slopes (3, 3), and their u."""
    values, step = _angles_deg(slopes), 1e-5
    variance = np.zeros(6)
    for place in np.ndindex(3, 3):
        moved = np.zeros((3, 3))
        moved[place] = step
        change = (_angles_deg(slopes + moved) - _angles_deg(slopes - moved)) / (2 * step)
        variance += (change * u[place]) ** 2
    return values, np.sqrt(variance)


def _angles_deg(slopes: Array) -> Array:
    left, singular, right = np.linalg.svd(slopes)
    rotation, symmetric = left @ right, (left * singular) @ left.T
    angle = np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1))
    across = np.array(
        [rotation[1, 2] - rotation[2, 1], rotation[2, 0] - rotation[0, 2], rotation[0, 1] - rotation[1, 0]]
    )
    turned = across * angle / np.linalg.norm(across)  # the axes of the triad turn against what they see
    rows = symmetric / np.linalg.norm(symmetric, axis=1, keepdims=True)
    between = np.arccos([rows[0] @ rows[1], rows[0] @ rows[2], rows[1] @ rows[2]])
    return np.degrees([*turned, *(np.pi / 2 - between)])


def white_std(readings: Array) -> float:
    """Return the standard deviation of the white part of readings (n,): by the median of their periodogram.

    Lines of the table's steps fill few frequencies, and drift the lowest. The window of Hann keeps a line narrow; the
    median of a periodogram is ln 2 of its mean.
    """
    window = np.hanning(len(readings))
    power = np.abs(np.fft.rfft((readings - readings.mean()) * window))[2:-1] ** 2 / np.sum(window**2)
    return float(np.sqrt(np.median(power) / np.log(2)))
