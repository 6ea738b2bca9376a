"""FreeIMU's warm-up: a parabola of the bias in the temperature, by least squares over all readings alike."""

from __future__ import annotations

import numpy as np

from studies.real.independent.files import AXES, Array, Found, Value, clustered, columns_of, numbers, root_mean_square

WORDS_PER_DPS = 16.4
#: deg C = word / WORDS_PER_K + ZERO_C, by the data sheet of the MPU-6050.
WORDS_PER_K, ZERO_C = 340.0, 36.53
CENTRE_C = 20.0
#: Readings of so many seconds err together; residuals of the parabola are correlated over a minute or two.
CLUSTER_S = 120.0
#: Means over which errors are stated, s, and parts of equal count that are left out in turn.
MEAN_S, PARTS = 17.0, 8


def readings() -> tuple[Array, Array, Array]:
    """Return times (n,) s, temperatures (n,) deg C and outputs (n, 3) deg/s."""
    columns = columns_of("freeimu-warmup.parquet")
    t_s = np.asarray(columns["Time"], dtype=np.float64) / 1000.0
    warm = np.asarray(columns["dTemp"], dtype=np.float64) / WORDS_PER_K + ZERO_C
    return t_s - t_s[0], warm, numbers(columns, "Gx", "Gy", "Gz") / WORDS_PER_DPS


def parabola(warm: Array) -> Array:
    """Return the design of a parabola about CENTRE_C, (n, 3)."""
    centred = warm - CENTRE_C
    return np.column_stack([np.ones(len(warm)), centred, centred**2])


def analysis() -> Found:
    """Return the coefficients about 20 deg C of each axis, and the error where parts of the range are left out."""
    t_s, warm, rates = readings()
    cluster = (t_s // CLUSTER_S).astype(np.int64)
    found: Found = {}
    for k, axis in enumerate(AXES):
        values, covariance = clustered(parabola(warm), rates[:, k], cluster)
        names = ("bias at 20 deg C, deg/s", "slope at 20 deg C, deg/s/K", "curvature, deg/s/K2")
        for name, value, variance in zip(names, values, np.diag(covariance), strict=True):
            found[f"{axis}: {name}"] = Value(float(value), float(np.sqrt(variance)))
    found["error at temperatures left out of the fit, deg/s"] = Value(held_out(t_s, warm, rates))
    return found


def means(t_s: Array, warm: Array, rates: Array) -> tuple[Array, Array]:
    """Return means over MEAN_S: temperatures (m,) and outputs (m, 3)."""
    part = (t_s // MEAN_S).astype(np.int64)
    _, number, count = np.unique(part, return_inverse=True, return_counts=True)
    sums = np.zeros((len(count), 4))
    np.add.at(sums, number, np.column_stack([warm, rates]))
    sums /= count[:, None]
    return sums[:, 0], sums[:, 1:]


def held_out(t_s: Array, warm: Array, rates: Array) -> float:
    """Return the error of means by parabolas that have not seen their eighth of the temperatures, deg/s."""
    warm, rates = means(t_s, warm, rates)
    part = np.argsort(np.argsort(warm)) * PARTS // len(warm)
    left = []
    for out in range(PARTS):
        seen = part != out
        values = np.linalg.lstsq(parabola(warm[seen]), rates[seen], rcond=None)[0]
        left.append(rates[~seen] - parabola(warm[~seen]) @ values)
    return root_mean_square(np.concatenate(left))
