"""Slow trend of a record at rest: a warm-up or a drift that the beginning of a record holds and noise does not.

Means of equal pieces of a record differ from one to the next. Of a random walk those differences are alike and without
order throughout; of a warm-up they are large at first and die away, of a ramp they have one sign. So straight lines,
parabolas and exponentials are fitted to the differences, and the best is believed when an F-test asks for it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from labctl.fitting.numeric.arrays import Array

#: Pieces into which a record is divided.
PIECES = 32
#: Time constants of a warm-up that are tried, as shares of the record.
SHARES = (0.03, 0.06, 0.12, 0.25, 0.5, 1.0)
#: Probability at which noise without any trend is taken for one.
FALSE_ALARM = 0.01


def slow_trend(rate_dps: Array) -> Array | None:
    """Return the trend of evenly spaced rates (n,), (n,) deg/s about 0; None where the record has none."""
    size = len(rate_dps) // PIECES
    if size < 2:
        return None
    steps = np.diff(rate_dps[: size * PIECES].reshape(PIECES, size).mean(axis=1))
    if not np.any(steps):
        return None
    where = (np.arange(PIECES) + 0.5) * size / len(rate_dps)
    laws = [np.column_stack([where, where**2, where**3])]
    laws += [np.column_stack([where, np.exp(-where / share)]) for share in SHARES]
    chances, fits = zip(*(_fit(np.diff(law, axis=0), steps) for law in laws), strict=True)
    best = int(np.argmin(chances))
    if chances[best] * len(laws) > FALSE_ALARM:
        return None
    at = np.arange(len(rate_dps)) / len(rate_dps)
    columns = [at, at**2, at**3] if best == 0 else [at, np.exp(-at / SHARES[best - 1])]
    trend = np.column_stack(columns) @ fits[best]
    return np.asarray(trend - trend.mean())


def _fit(design: NDArray[np.float64], steps: Array) -> tuple[float, Array]:
    """Return the probability that random steps fit a design as well by chance, and its coefficients."""
    coefficients, *_ = np.linalg.lstsq(design, steps)
    left = float(np.sum((steps - design @ coefficients) ** 2))
    k, freedom = design.shape[1], len(steps) - design.shape[1]
    gained = max(float(steps @ steps) - left, 0.0)
    return float(fdtrc(k, freedom, gained / k / max(left / freedom, 1e-300))), np.asarray(
        coefficients, dtype=np.float64
    )
