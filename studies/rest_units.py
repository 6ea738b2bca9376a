"""Simulated gyros at rest on temperature loops: a lag, a hysteresis, both or neither hidden at a known size.

Written apart from labctl's effects: the lagging element is integrated in steps of a second, and the hysteresis is the
exponential one of Duhem (Coleman and Hodgdon), not the play that the catalogue has.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from labctl.recording import Recording, RecordingInfo

Array = NDArray[np.float64]
COLD_C, HOT_C, SPEED_K_S, DWELL_S = -20.0, 60.0, 2.0 / 60.0, 1800.0
RATE_HZ, WINDOW_S = 2.0, 60.0
#: White noise, deg/s/sqrt(Hz), and drift between windows: standard deviation, deg/s, and time constant, s.
WHITE, DRIFT_DPS, DRIFT_TAU_S = 0.005, 5e-4, 1200.0


@dataclass(frozen=True)
class Hidden:
    """What is hidden: time constants of a lag, s, widths of a hysteresis, K (0: none), and the size of each.

    `of_axes` are factors of the time constant on each axis; `second` the share and the time constant of a second flow;
    `cooling` the factor of the time constant while the element cools; `heating_s` the time constant of self-heating.
    """

    lag_s: float = 0.0
    width_k: float = 0.0
    z: float = 30.0
    of_axes: tuple[float, ...] = (1.0,)
    second: tuple[float, float] = (0.0, 0.0)
    cooling: float = 1.0
    heating_s: float = 0.0

    def element_c(self, warm: Array, axis: int) -> Array | None:
        """Return the temperature of the element of an axis, second by second; None where no lag is hidden."""
        if not self.lag_s:
            return None
        first = lagged(warm, self.lag_s * self.of_axes[axis], self.cooling)
        share, tau_s = self.second
        return first if not share else (1 - share) * first + share * lagged(warm, tau_s * self.of_axes[axis])


def temperatures(loops: int) -> tuple[Array, Array]:
    """Return times, s, and thermometer, deg C, second by second: dwells of half an hour at both ends of each leg."""
    leg_s = (HOT_C - COLD_C) / SPEED_K_S
    t_s, warm = [0.0, DWELL_S], [COLD_C, COLD_C]
    for _ in range(loops):
        for target in (HOT_C, COLD_C):
            t_s += [t_s[-1] + leg_s, t_s[-1] + leg_s + DWELL_S]
            warm += [target, target]
    seconds = np.arange(0.0, t_s[-1])
    # a chamber does not turn on a point: the corners are rounded over two minutes
    sharp = np.interp(seconds, t_s, warm)
    kernel = np.hanning(121) / np.hanning(121).sum()
    return seconds, np.convolve(np.pad(sharp, 60, mode="edge"), kernel, mode="valid")


def lagged(warm: Array, tau_s: float, cooling: float = 1.0) -> Array:
    """Return the temperature of an element that follows `warm`, given second by second, by Heun's rule.

    `cooling` is the factor of the time constant while it is warmer than `warm`.
    """
    now, found = float(warm[0]), np.empty(len(warm))
    for k, there in enumerate(warm.tolist()):
        tau = tau_s * cooling if there < now else tau_s
        slope = (there - now) / tau
        now += (slope + (there - (now + slope)) / tau) / 2
        found[k] = now
    return found


def duhem(warm: Array, width_k: float) -> Array:
    """Return a hysteresis state in -1 to 1 that approaches the direction of the temperature over `width_k`."""
    state, found = 0.0, np.zeros(len(warm))
    for k, step in enumerate(np.diff(warm).tolist(), start=1):
        state += (np.sign(step) - state) * -np.expm1(-abs(step) / width_k)
        found[k] = state
    return found


def sized(shape: Array, warm: Array, z: float, beside: Array | None = None) -> Array:
    """Return an error shape second by second at the size at which its part beside a parabola of the temperature is z.

    z is the norm of that part in units of the noise of windows of a minute, drift and white noise together. Where two
    are hidden it is the part that the shape `beside` does not take either: they are alike, and with opposite signs
    nearly nothing would be left of both.
    """
    n = int(len(shape) // WINDOW_S)

    def means(values: Array) -> Array:
        return np.asarray(values[: int(n * WINDOW_S)].reshape(n, -1).mean(axis=1))

    middles = WINDOW_S * np.arange(n)
    noise = DRIFT_DPS**2 * np.exp(-np.abs(middles[:, None] - middles) / DRIFT_TAU_S)
    noise += np.eye(n) * WHITE**2 / WINDOW_S
    u = means((warm - 20.0) / 40.0)
    others = [] if beside is None else [means(beside)]
    rows = np.column_stack([np.ones(n), u, u**2, *others, means(shape)])
    white = solve_triangular(np.linalg.cholesky(noise), rows, lower=True)
    base, _ = np.linalg.qr(white[:, :-1])
    left = white[:, -1] - base @ (base.T @ white[:, -1])
    return shape * z / float(np.linalg.norm(left))


def unit_at_rest(seed: int, hidden: Hidden, loops: int = 2) -> Recording:
    """Return readings of one unit through loops, as one data set without a table's rate or a position."""
    rng = np.random.default_rng([17, seed])
    axes = ("z",) if len(hidden.of_axes) == 1 else ("x", "y", "z")
    t_s, warm = temperatures(loops)
    readings = np.arange(0.0, t_s[-1], 1.0 / RATE_HZ)
    columns: dict[str, Array] = {"t_s": readings, "temperature_c": np.interp(readings, t_s, warm)}
    columns["temperature_c"] = columns["temperature_c"] + rng.normal(size=len(readings)) * 0.02
    half_s = t_s[-1] / loops  # it is switched off and on between two loops
    if hidden.heating_s:
        columns["power_s"] = readings % half_s
    for k, axis in enumerate(axes):
        u = (warm - 20.0) / 40.0
        law = rng.normal() * 0.3 + rng.normal() * 0.2 * u + rng.normal() * 0.05 * u**2
        element_c = hidden.element_c(warm, k)
        behind = element_c - warm if element_c is not None else None
        loop = duhem(warm, hidden.width_k) if hidden.width_k else None
        for shape, other in ((behind, loop), (loop, behind)):
            if shape is not None:
                law = law + rng.choice([-1.0, 1.0]) * sized(shape, warm, hidden.z, other)
        if hidden.heating_s:
            law = law + rng.choice([-1.0, 1.0]) * sized(
                np.exp(-(t_s % half_s) / hidden.heating_s), warm, hidden.z, behind
            )
        noise = rng.normal(size=len(readings)) * WHITE * np.sqrt(RATE_HZ)
        columns[f"gyro_{axis}"] = np.interp(readings, t_s, law + _drift(rng, len(t_s))) + noise
    info = RecordingInfo(
        serial=f"REST-{seed}", axes=axes, kind="samples", motion="rest", technology="mems",
        started_at=datetime(2026, 1, 1, tzinfo=UTC), sample_rate_hz=RATE_HZ,
    )  # fmt: skip
    n = len(readings)
    one = np.ones(n, dtype=np.int64)
    whole = {"dataset": one, **columns, "run": one, "mounting": one, "position": np.full(n, axes[0])}
    return Recording(info, {**whole, "table_rate_dps": np.zeros(n)})


def _drift(rng: np.random.Generator, n: int) -> Array:
    """Return an Ornstein-Uhlenbeck drift second by second, (n,) deg/s."""
    keep = np.exp(-1.0 / DRIFT_TAU_S)
    state, found = rng.normal() * DRIFT_DPS, np.empty(n)
    for k, kick in enumerate((rng.normal(size=n) * DRIFT_DPS * np.sqrt(1 - keep**2)).tolist()):
        state = keep * state + kick
        found[k] = state
    return found
