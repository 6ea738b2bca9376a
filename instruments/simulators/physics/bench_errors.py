"""True errors of a simulated bench, drawn from the distributions that its reference standards state."""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from instruments.standards import Standard

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BenchErrors:
    """Errors of one bench, indicated minus true. A bench whose standards are not drawn from is exact."""

    rate: float = 0.0  #: relative, of the table's rate
    air_c: float = 0.0  #: of the chamber's thermometer at the units, K
    level_deg: float = 0.0  #: by which the axis of rotation leans to the north
    #: Body axis that points up -> how the unit leans in its mounting towards the next two body axes, radians.
    lean_rad: tuple[tuple[float, float], ...] = ((0.0, 0.0),) * 3

    @staticmethod
    def drawn(standards: Sequence[Standard], seed: list[int]) -> BenchErrors:
        """Return errors drawn from what the standards state; what none states is exact."""
        rng = np.random.default_rng([*seed, zlib.crc32(b"standards")])
        of = {
            quantity: sum((_drawn(each, rng) for each in standards if each.quantity == quantity), np.zeros(6))
            for quantity in ("thermometer", "chamber_gradient", "fixture_angle", "tilt", "level")
        }
        table = sum(float(_drawn(each, rng)[0]) for each in standards if each.unit_name == "ppm")
        mounted = of["fixture_angle"].reshape(3, 2) + of["tilt"][:2]
        return BenchErrors(
            1e-6 * table,
            float(of["thermometer"][0] + of["chamber_gradient"][0]),
            float(of["level"][0]),
            tuple((math.radians(a), math.radians(b)) for a, b in mounted.tolist()),
        )

    def felt(self, rates: Array, up: int) -> Array:
        """Return the rates (n, 3) about the axes of a unit, deg/s, that leans in its mounting."""
        toward_first, toward_second = self.lean_rad[up]
        if toward_first == toward_second == 0:
            return rates
        first, second = (up + 1) % 3, (up + 2) % 3
        turned = _rotated(rates, up, first, toward_first)
        return _rotated(turned, up, second, toward_second)


def _rotated(rates: Array, one: int, other: int, angle_rad: float) -> Array:
    """Return rates (n, 3) in axes that are turned by an angle in the plane of two of them."""
    turned = rates.copy()
    turned[:, one] = np.cos(angle_rad) * rates[:, one] - np.sin(angle_rad) * rates[:, other]
    turned[:, other] = np.sin(angle_rad) * rates[:, one] + np.cos(angle_rad) * rates[:, other]
    return turned


def _drawn(standard: Standard, rng: np.random.Generator) -> Array:
    """Return six errors from the distribution that a standard states, in its unit."""
    width = standard.half_width
    if width is None:
        return rng.normal(0.0, standard.standard_u, 6)
    if standard.distribution == "triangular":
        return rng.triangular(-width, 0.0, width, 6) if width else np.zeros(6)
    if standard.distribution == "u-shaped":
        return np.asarray(width * np.sin(rng.uniform(-math.pi, math.pi, 6)))
    return rng.uniform(-width, width, 6)
