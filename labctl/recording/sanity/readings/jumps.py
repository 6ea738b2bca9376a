"""A level that jumps within a drift: straight lines before and after a row differ at that row."""

from __future__ import annotations

import numpy as np

from labctl.recording.sanity.readings.series import ROBUST, Array

#: Readings of a line on either side: few, so that the drift beneath is straight.
READINGS = 12
#: A jump is so many noises, so many usual differences of such lines, and so many steps of the code.
NOISES, USUAL, CODES = 8.0, 7.0, 3.0
#: The medians beside the row, and the two readings next to it, differ by this share of the jump; none leads back by
#: such a share of it.
MEDIAN_SHARE, NEXT_SHARE, BACK_SHARE = 0.6, 0.4, 0.6


def jump_of(values: Array, noise: float, code_step: float) -> int | None:
    """Return the row from which the level of (n,) readings at rest is another one; None where it only drifts.

    `noise` is the standard deviation of one reading. A single reading that is off is no jump, nor a motion that ends.
    """
    if len(values) < 4 * READINGS or noise <= 0:
        return None
    apart = _apart(values)
    usual = ROBUST * float(np.median(np.abs(apart)))
    row = int(np.argmax(np.abs(apart)))
    size = float(apart[row])
    if abs(size) < max(NOISES * noise, USUAL * usual, CODES * code_step):
        return None
    at = row + READINGS
    half = READINGS // 2
    medians = float(np.median(values[at : at + half]) - np.median(values[at - half : at]))
    stays = float(np.max(-np.sign(size) * apart)) < BACK_SHARE * abs(size)
    next_to = float(values[at] - values[at - 1])
    if medians / size < MEDIAN_SHARE or next_to / size < NEXT_SHARE or not stays:
        return None
    return at


def _apart(values: Array) -> Array:
    """Return lines through the readings from a row on less those before it, midway, (n - 2 READINGS + 1,)."""
    x = np.arange(READINGS) - (READINGS - 1) / 2
    after = 1.0 / READINGS - x * (READINGS / 2) / float(x @ x)  # of a line, its value half a step before the first
    weights = np.concatenate([-after[::-1], after])
    return np.asarray(np.correlate(values - float(np.median(values)), weights, mode="valid"))
