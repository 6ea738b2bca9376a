"""Pathfinder's satellite in a cold chamber: a parabola of the bias through the medians of 25 bursts at rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from studies.real.independent.files import AXES, Array, Found, Value, columns_of, numbers

#: deg C = BASE_C + word / WORDS_PER_K with the word as a signed one of 16 bits: likely, not documented.
BASE_C, WORDS_PER_K, WORD_BITS = 25.0, 256.0, 16
#: Temperature that coefficients are about; a gap of so many ms divides bursts.
CENTRE_C, GAP_MS = 20.0, 10_000.0


def readings() -> tuple[Array, Array, NDArray[np.int64]]:
    """Return the temperatures (n,) deg C, the outputs (n, 3) deg/s and the burst of each reading, (n,) from 0."""
    columns = columns_of("pan-cooldown.parquet")
    time_ms, word = (np.asarray(columns[name], dtype=np.float64) for name in ("time (ms)", "temp"))
    word = np.where(word >= 2 ** (WORD_BITS - 1), word - 2**WORD_BITS, word)
    rates = np.degrees(numbers(columns, "gyrox rad/s", "gyroy rad/s", "gyroz rad/s"))
    burst = np.concatenate([[0], np.cumsum(np.diff(time_ms) > GAP_MS)])
    return BASE_C + word / WORDS_PER_K, rates, burst


def bursts() -> tuple[Array, Array]:
    """Return the mean temperature (25,) deg C and the median outputs (25, 3) deg/s of each burst.

    The median is not moved by the few spikes that the authors took out by hand.
    """
    warm, rates, burst = readings()
    each = [burst == number for number in range(int(burst.max()) + 1)]
    return np.array([warm[part].mean() for part in each]), np.array([np.median(rates[part], axis=0) for part in each])


def analysis() -> Found:
    """Return the coefficients of each axis; the uncertainty is that of independent bursts, from their scatter."""
    warm, rates = bursts()
    centred = warm - CENTRE_C
    design = np.column_stack([np.ones(len(warm)), centred, centred**2])
    inverse = np.linalg.inv(design.T @ design)
    found: Found = {}
    for k, axis in enumerate(AXES):
        values = inverse @ (design.T @ rates[:, k])
        left = rates[:, k] - design @ values
        u = np.sqrt(np.diag(inverse) * (left @ left) / (len(left) - design.shape[1]))
        for name, value, of_value in zip(
            ("bias at 20 deg C, deg/s", "slope at 20 deg C, deg/s/K"), values, u, strict=False
        ):
            found[f"{axis}: {name}"] = Value(float(value), float(of_value))
    return found
