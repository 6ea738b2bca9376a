"""Windows of a recording whose rate changes: a few readings each, over which output and reference are averaged.

The mean of the output over a window is compared with the mean of the reference over the same window, so it is exact
however long the window is. Only changes faster than once in two windows are lost.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.recording.recording import Columns
from labctl.recording.spread import MIN_FOR_SPECTRUM, white_std

#: Windows of a recording, about: a window is as many readings as it takes to stay below.
MAX_WINDOWS = 20_000
#: Readings further apart than this many usual steps have a gap between them: no window goes across it.
GAP_STEPS = 3.0
#: The beginning and the end of a stretch are left out, this long, s, and at most this share of it: an output with a
#: delay depends there on rates outside the stretch, which are not known.
EDGE_S, EDGE_SHARE = 0.25, 0.05
#: Readings before and after that may shape an output, beside powers of the rate, where its white noise is sought.
LAGS = 16
#: A stretch is divided into pieces of so many readings for that, which keeps memory bounded.
PIECE = 20_000


def stretch_starts(columns: Columns) -> NDArray[np.int64]:
    """Return the rows, (m,), at which an even stretch of readings (n,) begins: at the first, and after each gap."""
    t_s = np.asarray(columns["t_s"], dtype=np.float64)
    steps = np.diff(t_s)
    usual = usual_step_s(columns)
    return np.concatenate([[0], np.flatnonzero((steps > GAP_STEPS * usual) | (steps <= 0)) + 1]).astype(np.int64)


def usual_step_s(columns: Columns) -> float:
    """Return the usual time from one reading to the next, s; 1 for a single reading."""
    steps = np.diff(np.asarray(columns["t_s"], dtype=np.float64))
    steps = steps[steps > 0]
    return float(np.median(steps)) if len(steps) else 1.0


def window_labels(columns: Columns) -> NDArray[np.int64]:
    """Return labels (n,) of readings that rise by 1 from window to window; none goes across data sets or a gap."""
    dataset = np.asarray(columns["dataset"], dtype=np.int64)
    n = len(dataset)
    if n == 0:
        return np.zeros(0, dtype=np.int64)
    begins = np.concatenate([[True], dataset[1:] != dataset[:-1]])
    begins[stretch_starts(columns)] = True
    starts = np.flatnonzero(begins)
    ordinal = np.arange(n) - np.repeat(starts, np.diff(np.append(starts, n)))
    return np.cumsum(begins | (ordinal % (-(-n // MAX_WINDOWS)) == 0)).astype(np.int64) - 1


def kept_windows(columns: Columns, labels: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the numbers, rising, of the windows of readings (n,) that lie off the ends of their stretch."""
    t_s, starts = np.asarray(columns["t_s"], dtype=np.float64), stretch_starts(columns)
    ends = np.append(starts[1:], len(t_s)) - 1
    sizes = ends - starts + 1
    first, last = np.repeat(t_s[starts], sizes), np.repeat(t_s[ends], sizes)
    edge = np.minimum(EDGE_S, EDGE_SHARE * (last - first))
    off = (t_s < first + edge) | (t_s > last - edge)
    return np.flatnonzero(np.bincount(labels, weights=off) == 0)


def white_std_of_profile(columns: Columns, output: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the white standard deviation of a reading, (n,) in the output's unit; None where readings are too few.

    It is what the spectrum holds of the part of the output that no linear function of the rates before and after, and
    no power of the rate, follows: neither delay, bandwidth nor scale factor count as noise.
    """
    rate = np.asarray(columns["table_rate_dps"], dtype=np.float64)
    starts = stretch_starts(columns)
    white_std_dps, sizes = np.full(len(rate), np.nan), np.diff(np.append(starts, len(rate)))
    for begin, size in zip(starts.tolist(), sizes.tolist(), strict=True):
        for first in range(begin, begin + size, PIECE):
            piece = slice(first, min(first + PIECE, begin + size))
            if piece.stop - piece.start >= MIN_FOR_SPECTRUM + 6 * LAGS:
                white_std_dps[piece] = white_std(_not_followed(rate[piece], output[piece]))
    is_finite = np.isfinite(white_std_dps)
    if not is_finite.any():
        return None
    return np.where(is_finite, white_std_dps, np.sqrt(np.mean(white_std_dps[is_finite] ** 2)))


def _not_followed(rate: NDArray[np.float64], output: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what of an output (n,) follows neither rates nearby nor powers of the rate, (n - 2 * LAGS,)."""
    inner = slice(LAGS, len(rate) - LAGS)
    near = np.lib.stride_tricks.sliding_window_view(rate, 2 * LAGS + 1)
    share = rate[inner] / max(float(np.abs(rate).max()), 1e-300)
    others = [np.ones_like(share), np.linspace(-1.0, 1.0, len(share)), np.abs(share), share**2, share**3]
    design = np.column_stack([near, *others])
    design = design / np.maximum(np.linalg.norm(design, axis=0), 1e-300)
    solution, *_ = np.linalg.lstsq(design, output[inner], rcond=1e-10)
    return np.asarray(output[inner] - design @ solution)
