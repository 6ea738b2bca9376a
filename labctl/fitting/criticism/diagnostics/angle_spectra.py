"""What happens inside data sets: waves in the table angle, waves in time, and the first seconds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from labctl.answers.views import AngleLine, AngleSpectrum, FrequencySpectrum, StartProfile
from labctl.fitting.criticism.diagnostics.axis import BAND
from labctl.fitting.criticism.diagnostics.within_dataset import MIN_READINGS, Residual, Within
from labctl.fitting.criticism.reduction import STEP_LINES
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.json_numbers import plain, plain_list

#: Waves in the angle are computed over data sets of at least this many turns ...
TURNS = 2.0
#: ... up to this many cycles per turn, where the readings are close enough to resolve them ...
MAX_PER_TURN = 208
#: ... and where there are at least this many such data sets.
MIN_SETS = 6
ANGLE_BINS = 2048
FREQUENCIES = 200
PROFILE_POINTS = 40
#: Probability that noise alone puts the highest of all waves above the limit.
ALARM = 0.05


def angle_lines(within: Within, residual: Residual, axis: str) -> list[AngleSpectrum]:
    """Return the mean power of waves in the table angle over white noise, by cycles per turn."""
    if within.angle is None:
        return []
    count = within.presence.sum(axis=1).astype(np.int64)
    last = np.take_along_axis(within.angle, np.maximum(count - 1, 0)[:, None], axis=1)[:, 0]
    turns = np.abs(last - within.angle[:, 0])
    rows = np.flatnonzero((turns >= TURNS) & (count >= MIN_READINGS))
    if len(rows) < MIN_SETS:
        return []
    window = _hann(count[rows], residual.dps.shape[1]) * residual.presence[rows]
    bins = np.floor(np.mod(within.angle[rows], 1.0) * ANGLE_BINS).astype(np.int64) % ANGLE_BINS
    flat = bins + ANGLE_BINS * np.arange(len(rows))[:, None]
    sums = np.bincount(flat.ravel(), (residual.dps[rows] * window).ravel(), ANGLE_BINS * len(rows))
    power = np.abs(np.fft.rfft(sums.reshape(len(rows), ANGLE_BINS), axis=1)[:, 1 : MAX_PER_TURN + 1]) ** 2
    energy, whole = (window**2).sum(axis=1)[:, None], window.sum(axis=1)[:, None]
    cycles = np.arange(1, MAX_PER_TURN + 1)
    followed = cycles[None, :] < 0.5 * count[rows][:, None] / turns[rows][:, None]
    enough = followed.sum(axis=0) >= MIN_SETS
    cycles, sets = cycles[enough], followed.sum(axis=0)[enough]
    if not len(cycles):
        return []

    def mean(values: NDArray[np.float64]) -> Array:
        return np.where(followed, values, 0.0)[:, enough].sum(axis=0) / sets

    level = float(np.median(mean(power / energy)))
    over = mean(power / energy) / max(level, 1e-300)
    amplitude = np.sqrt(4 * np.maximum(mean((power - level * energy) / whole**2), 0.0))
    limit = chdtri(2 * sets, ALARM / len(cycles)) / (2 * sets)
    lines = sorted(np.flatnonzero(over > limit).tolist(), key=lambda k: -over[k])[:8]
    return [
        {
            "axis": axis,
            "datasets": len(rows),
            "cycles_per_turn": cycles.tolist(),
            "over_white": plain_list(over),
            "limit": plain_list(limit),
            "lines": [{"cycles_per_turn": int(cycles[k]), "amplitude_dps": plain(amplitude[k])} for k in lines],
            "stepper_lines": _stepper(within, residual, count),
        }
    ]


def _stepper(within: Within, residual: Residual, count: NDArray[np.int64]) -> list[AngleLine]:
    """Return the amplitude of the lines that were taken out, RMS over the data sets that show them."""
    spectral_lines: list[AngleLine] = []
    for k, cycles in enumerate(STEP_LINES):
        pair = residual.lines[2 * k : 2 * k + 2]
        is_shown = np.any(within.basis[1 + 2 * k : 3 + 2 * k], axis=(0, 2))
        if is_shown.any():
            squared = 2 * (pair**2).sum(axis=0)[is_shown] / count[is_shown]
            spectral_lines.append({"cycles_per_turn": cycles, "amplitude_dps": plain(np.sqrt(squared.mean()))})
    return spectral_lines


def _hann(count: NDArray[np.int64], n: int) -> NDArray[np.float64]:
    offset = np.arange(n)[None, :]
    waves = 0.5 - 0.5 * np.cos(2 * np.pi * (offset + 0.5) / np.maximum(count, 1)[:, None])
    return np.where(offset < count[:, None], waves, 0.0)


def frequency_lines(within: Within, residual: Residual, axis: str) -> list[FrequencySpectrum]:
    """Return the mean power of waves in time within data sets over white noise, by frequency."""
    count = within.presence.sum(axis=1).astype(np.int64)
    usual = int(np.median(count))
    rows = np.flatnonzero(count >= usual)
    if usual < MIN_READINGS or len(rows) < MIN_SETS:
        return []
    window = _hann(np.full(len(rows), usual), usual)
    spectrum = np.abs(np.fft.rfft(residual.dps[rows, :usual] * window, axis=1)) ** 2
    power = spectrum.mean(axis=0)[3:-1]  # mean and slope are gone from the first
    hz = np.fft.rfftfreq(usual, within.period_s)[3:-1]
    every = -(-len(hz) // FREQUENCIES)
    starts = np.arange(0, len(hz), every)
    widths = np.diff(np.append(starts, len(hz)))
    over = np.add.reduceat(power, starts) / widths / max(float(np.median(power)), 1e-300)
    freedom = 2.0 * len(rows) * widths
    return [
        {
            "axis": axis,
            "datasets": len(rows),
            "hz": plain_list(np.add.reduceat(hz, starts) / widths),
            "over_white": plain_list(over),
            "limit": plain_list(chdtri(freedom, ALARM / len(starts)) / freedom),
        }
    ]


def start_profile(within: Within, residual: Residual, axis: str) -> list[StartProfile]:
    """Return the mean course within data sets: plain, and by the step in rate that came before, per deg/s of it."""
    values = (residual.dps + residual.slope[:, None] * within.basis[-1]) * residual.presence
    usual = int(np.median(within.presence.sum(axis=1)))
    edges = np.unique(np.linspace(0, usual, min(PROFILE_POINTS, usual) + 1).round().astype(np.int64))[:-1]
    seconds = within.since_s[:, :usual]
    step = (within.rate_dps - within.previous_dps) * within.up(axis)
    presence = residual.presence[:, :usual]
    sums, counts = (np.add.reduceat(part[:, :usual], edges, axis=1) for part in (values, residual.presence))
    total = np.maximum(counts.sum(axis=0), 1.0)
    size = np.maximum((step[:, None] ** 2 * counts).sum(axis=0), 1e-300)
    time = np.add.reduceat((seconds * presence).sum(axis=0), edges) / np.maximum(
        np.add.reduceat(presence.sum(axis=0), edges), 1.0
    )
    profile: StartProfile = {
        "axis": axis,
        "datasets": len(step),
        "since_s": plain_list(time),
        "mean_dps": plain_list(sums.sum(axis=0) / total),
        "band_dps": plain_list(BAND * residual.spread_dps / np.sqrt(total)),
    }
    if np.any(step):
        profile["per_step"] = plain_list((step[:, None] * sums).sum(axis=0) / size)
        profile["per_step_band"] = plain_list(BAND * residual.spread_dps / np.sqrt(size))
    return [profile]
