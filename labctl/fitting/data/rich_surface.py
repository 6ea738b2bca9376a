"""Rich surface of an axis' error: what data sets can have in common whatever the model, so that the rest is noise.

A level of its own for every rate of every position (a dead band or missed steps need no shape), smooth functions of
temperature that also multiply the rates, what is logged of the surroundings, the time since power-on, and the direction
in which the temperature goes; where the data ask for it a level of its own for every discrete temperature too.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from labctl.fitting.data.channels import Channels
from labctl.fitting.data.levels import level_centres, rate_levels
from labctl.fitting.data.response import Response
from labctl.fitting.data.shifts import shift_columns
from labctl.fitting.data.temperature.levels import temperature_levels
from labctl.fitting.numeric.arrays import Array
from labctl.recording.columns import OWN_DATASET, RATE_TIME_U, READING_TIMES, RECORDING, WITHIN_S

#: Largest number of columns, as a share of the number of data sets (also with levels), and least degrees of freedom.
MAX_SHARE, MAX_SHARE_WITH_LEVELS, MIN_FREE = 0.5, 0.7, 8
#: Largest degree in temperature of the bias, of the scale factor and of the terms quadratic and cubic in the rate.
DEGREES = (6, 4, 2, 2)
#: Time constants of a warm-up after power-on, s.
WARM_UP_S = (600.0, 3600.0)
#: Time constants of lags, s, and widths of hystereses, K, that a loop of temperatures shows.
LAGS_S, WIDTHS_K = (150.0, 400.0, 1000.0, 2500.0), (2.0, 6.0, 15.0)
#: A table measures on ramps where half of the data sets have at least this rate of change, K/min, over so long, s.
RAMP_K_MIN, RAMP_S = 0.1, 300.0
#: A column of which those before it leave less than this share says nothing new.
MIN_NEW = 1e-2
#: Delays and time constants, s, whose mixtures follow any response of a gyro: the surface of a rate that changes.
DELAYS_S = (1e-3, -1e-3, 3e-3, 1e-2, 2e-2, 5e-2)
TIME_CONSTANTS_S = (1e-3, 3e-3, 1e-2, 3e-2, 0.1, 1.0, 5.0)
#: The same share for those: they are nearly alike, and what distinguishes them is large beside the noise.
MIN_NEW_OF_RESPONSE = 1e-6
#: Logged columns that cause no error themselves, or that the surface has in another form.
NO_SURROUNDINGS = frozenset({
    "t_s", "table_rate_dps", "table_angle_deg", "dataset", "position", "mounting", "run", "n", "duration_s",
    "since_begin_s", "valid", "temperature_c", "temperature_x_c", "temperature_y_c", "temperature_z_c", "power_s",
    "turn_deg", "turn_u_deg",
    RECORDING, WITHIN_S, OWN_DATASET, *READING_TIMES, *RATE_TIME_U,
})  # fmt: skip


def rich_surface(channels: Channels, axis: str) -> NDArray[np.float64]:
    """Return orthonormal columns (m, k), the most important first; k is at most half of m, and at most m - 8.

    Of turns no law can be found that is not linear in the rate; what is linear is taken in whole, whatever m is.
    """
    if "turn_deg" in channels:
        temperature_basis, rate = (
            _chebyshev(channels.temperature_c(axis), max(DEGREES)),
            channels.rate_dps(axis)[:, None],
        )
        return _orthonormal(
            iter([temperature_basis[:, 1:4], temperature_basis[:, 1:3] * rate]), _linear(channels), MAX_SHARE
        )
    responses = _orthonormal(
        iter([_of_responses(channels, axis)]), np.zeros((len(channels), 0)), MAX_SHARE, MIN_NEW_OF_RESPONSE
    )
    return _orthonormal(_blocks(channels, axis), responses, MAX_SHARE)


def with_levels_of_temperature(surface: NDArray[np.float64], channels: Channels, axis: str) -> NDArray[np.float64]:
    """Return a surface (m, k) with a level of its own for every discrete temperature, at most 0.7 m columns in all.

    On a single rising leg of temperatures these levels absorb a drift in time, so they are only for laws that need
    them.
    """
    rate = _scaled(channels.rate_dps(axis), about_zero=True)
    levels = _levels_of_temperature(channels.temperature_c(axis), rate)
    return _orthonormal(iter([levels]), surface, MAX_SHARE_WITH_LEVELS)


def _orthonormal(
    blocks: Iterator[NDArray[np.float64]], begin: NDArray[np.float64], share: float, least_new: float = MIN_NEW
) -> NDArray[np.float64]:
    m, k = begin.shape
    most = min(int(share * m), m - MIN_FREE)
    orthonormal = np.empty((m, max(most, k)), order="F")
    orthonormal[:, :k] = begin
    for block in blocks:
        for column in block.T:
            if k < most and (new := _new_part(column, orthonormal[:, :k], least_new)) is not None:
                orthonormal[:, k] = new
                k += 1
    return orthonormal[:, :k]


def _linear(channels: Channels) -> NDArray[np.float64]:
    """Return orthonormal columns (m, k) of a bias in every position and the response to every axis."""
    places = [rows.astype(np.float64) for _, rows in channels.positions()]
    independent = np.zeros((len(channels), 0))
    for column in (*places, *channels.rates.values()):
        if (new := _new_part(column, independent, MIN_NEW)) is not None:
            independent = np.column_stack([independent, new])
    return independent


def _new_part(column: Array, basis: NDArray[np.float64], least_new: float) -> Array | None:
    size = float(np.linalg.norm(column))
    if size == 0:
        return None
    residual = column / size
    for _ in range(2):  # the second time takes out what rounding left
        residual = residual - basis @ (basis.T @ residual)
    new = float(np.linalg.norm(residual))
    return np.asarray(residual / new) if new > least_new else None


def _blocks(channels: Channels, axis: str) -> Iterator[NDArray[np.float64]]:
    """Yield columns (m, k), the most important first."""
    m = len(channels)
    rate = _scaled(channels.rate_dps(axis), about_zero=True)
    powers = np.column_stack([np.ones(m), rate, rate**2, rate**3])
    temperature_basis = _chebyshev(channels.temperature_c(axis), max(DEGREES))
    places = np.column_stack([rows.astype(np.float64) for _, rows in channels.positions()])
    yield places
    yield powers[:, 1:]
    yield shift_columns(channels, axis)
    yield from _of_other_axes(channels, axis, temperature_basis)
    for degree in range(1, max(DEGREES) + 1):
        yield np.column_stack(
            [temperature_basis[:, degree] * powers[:, n] for n, most in enumerate(DEGREES) if degree <= most]
        )
    if channels.profile is None:
        yield _levels_of_rate(channels)
    yield from _history(channels, temperature_basis, rate)
    for name in sorted(set(channels.columns) - NO_SURROUNDINGS):
        values = channels[name]
        if not name.startswith("gyro_") and np.issubdtype(values.dtype, np.number) and np.all(np.isfinite(values)):
            around = _scaled(np.asarray(values, dtype=np.float64))
            yield np.column_stack([around, around * rate])
    yield np.column_stack([(place * powers[:, 1:].T).T for place in places.T])
    yield np.column_stack([(place * temperature_basis[:, 1:4].T).T for place in places.T])


def _of_responses(channels: Channels, axis: str) -> NDArray[np.float64]:
    """Return the rate as it comes through responses, less the rate, (m, k); none where each data set has one rate."""
    if channels.profile is None:
        return np.zeros((len(channels), 0))
    responses = [Response(delay_s=delay) for delay in DELAYS_S] + [Response(0.0, tau) for tau in TIME_CONSTANTS_S]
    rate = channels.rate_dps(axis)
    return np.column_stack([rate, *(channels.through(response).rate_dps(axis) - rate for response in responses)])


def _of_other_axes(channels: Channels, axis: str, temperature_c: NDArray[np.float64]) -> Iterator[NDArray[np.float64]]:
    """Yield the rate about each other axis, alone, and times linear and quadratic functions of temperature."""
    for other in channels.rates:
        if other != axis:
            yield _scaled(channels.rate_dps(other), about_zero=True)[:, None] * temperature_c[:, :3]


def _levels_of_temperature(temperature_c: Array, rate: Array) -> NDArray[np.float64]:
    """Return the indicators of discrete temperatures, (m, k): as bias, as scale factor, and with slopes.

    A law that is steep between two levels is no polynomial over all of them, and within a level it turns even
    hundredths of a kelvin into an error.
    """
    level = temperature_levels(temperature_c)
    if level is None:
        return np.zeros((len(temperature_c), 0))
    at_level = np.eye(int(level.max()) + 1)[level]
    within = temperature_c - level_centres(temperature_c, level)
    return np.column_stack(
        [at_level, at_level * rate[:, None], at_level * within[:, None], at_level * (within * rate)[:, None]]
    )


def _levels_of_rate(channels: Channels) -> NDArray[np.float64]:
    """Return the indicators of every rate of every position, (m, k)."""
    level = rate_levels(channels.table_rate_dps())
    position = np.asarray(channels["position"]).astype(np.str_)
    _, cell = np.unique(np.char.add(position, level.astype(np.str_)), return_inverse=True)
    return np.asarray(np.eye(int(cell.max()) + 1)[cell])


def _history(channels: Channels, temperature_c: NDArray[np.float64], rate: Array) -> Iterator[NDArray[np.float64]]:
    """Yield columns that distinguish rising from falling temperatures, and functions of the time since power-on."""
    if "t_s" not in channels:
        return
    t_s = np.asarray(channels["t_s"], dtype=np.float64)
    order = np.argsort(t_s, kind="stable")
    steps = np.diff(temperature_c[order, 1], prepend=temperature_c[order[0], 1])
    rising = np.empty(len(t_s))
    rising[order] = np.sign(np.where(np.abs(steps) > 1e-3, steps, 0.0))
    leg = _carried(rising[order])
    direction = np.empty(len(t_s))
    direction[order] = leg
    if np.ptp(direction) > 0:
        yield np.column_stack(
            [direction, direction * temperature_c[:, 1], direction * temperature_c[:, 2], direction * rate]
        )
    if channels.history.profiles and (not np.any(rate) or _is_on_ramps(channels)):
        lags = np.column_stack([channels.history.lag_k(channels.columns, tau) for tau in LAGS_S])
        states = [channels.history.hysteresis_state(channels.columns, width) for width in WIDTHS_K]
        yield np.column_stack([lags, *states])
        yield lags * rate[:, None]
    since = np.asarray(channels["power_s"], dtype=np.float64) if "power_s" in channels else since_first(channels)
    since = np.maximum(since, 0.0)
    decays = np.column_stack([np.exp(-since / tau) for tau in WARM_UP_S])
    yield np.column_stack([decays, decays * rate[:, None]])


def _is_on_ramps(channels: Channels) -> bool:
    """Return whether the temperature is not held while the table turns: then a lag is seen, and not its rest alone."""
    return bool(np.median(np.abs(channels.history.rate_k_min(channels.columns, RAMP_S))) >= RAMP_K_MIN)


def since_first(channels: Channels) -> Array:
    """Return the time since the first row of the same recording, (m,) s."""
    t_s = channels.recording_t_s()
    elapsed_s = np.empty(len(t_s))
    for rows in channels.by_recording(np.ones(len(t_s), dtype=bool)):
        elapsed_s[rows] = t_s[rows] - t_s[rows].min()
    return elapsed_s


def _carried(signs: Array) -> Array:
    """Return signs (m,) in order of time with each 0 replaced by the last sign before it, at the start by the first."""
    rows = np.flatnonzero(signs)
    if not len(rows):
        return signs
    last = np.searchsorted(rows, np.arange(len(signs)), side="right") - 1
    return np.asarray(signs[rows[np.maximum(last, 0)]])


def _scaled(values: Array, *, about_zero: bool = False) -> Array:
    """Return values (m,) in -1 to 1: about their middle, or as they are over the largest."""
    if about_zero:
        return np.asarray(values / max(float(np.abs(values).max()), 1e-300))
    half = float(np.ptp(values)) / 2
    return np.asarray((values - values.min()) / half - 1.0) if half > 0 else np.zeros(len(values))


def _chebyshev(temperature_c: Array, degree: int) -> NDArray[np.float64]:
    return np.asarray(chebyshev.chebvander(_scaled(temperature_c), degree), dtype=np.float64)
