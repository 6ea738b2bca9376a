"""Compensation of an array by the direct polynomial, beside numpy's polyval2d and the bare memory copy, on one core."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import polynomial

from benchmarks.machine import describe, median_s
from labctl.fitting.models.polynomial_surface import Surface

N = 4_000_000


def run() -> dict[str, float | str]:
    """Return million readings per second of the three, measured in one run."""
    rng = np.random.default_rng(1)
    output, warm = rng.normal(0, 50, (N, 1)), rng.uniform(25, 45, N)
    c = rng.normal(0, 1e-3, (4, 3)) / 100.0 ** np.arange(4)[:, None]
    surface, target = Surface(c[None], 35.0), np.empty((N, 3))
    source = rng.normal(size=(N, 3))

    def with_numpy() -> np.ndarray:
        return output[:, 0] - polynomial.polyval2d(output[:, 0], warm - 35.0, c)

    assert np.allclose(surface.correct(output, warm)[:, 0], with_numpy(), atol=1e-12)
    ours = N / median_s(lambda: surface.correct(output, warm)) / 1e6
    theirs = N / median_s(with_numpy) / 1e6
    copy = N / median_s(lambda: np.copyto(target, source)) / 1e6
    return {
        **describe("numpy"),
        "labctl_million_per_s": ours,
        "polyval2d_million_per_s": theirs,
        "copy_of_24_bytes_million_per_s": copy,
        "labctl_over_polyval2d": ours / theirs,
    }
