"""U of a corrected rate where a unit with three outputs turns about any axis: NumPy only, nothing of labctl.

`docs/explanation/uncertainty-budget.md` states it under *Rate vectors* and *Coverage*.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from studies.page_figures_budget import ANGLES, CANCEL, COVERAGE, coverage_factor, effective_freedom, u_of
from studies.page_figures_formulas import Law
from studies.page_figures_left import Left

Array = np.ndarray
#: Share of the variance that is not normal, below which the coverage factor is that of a normal distribution.
NOT_NORMAL = 0.1
#: Standard uncertainties of a normal distribution with the coverage probability.
NORMAL_K = 2.0000024439


def rate_vectors(reach_dps: float) -> Array:
    """Return rest, the ends of axes and diagonals at the fastest rate, and the axes half-way, (33, 3)."""
    signs = np.array([each for each in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(each)])
    axes = signs[np.abs(signs).sum(axis=1) == 1] / 2
    return reach_dps * np.vstack([np.zeros(3), signs / np.linalg.norm(signs, axis=1, keepdims=True), axes])


@dataclass(frozen=True)
class Part:
    """One contribution to a corrected rate: independent parts of one distribution, and degrees of freedom."""

    sizes_dps: tuple[float, ...]
    distribution: str = "normal"
    freedom: float | None = None

    @property
    def variance(self) -> float:
        """The variance of all parts together."""
        return float(np.sum(np.square(self.sizes_dps)))


@dataclass(frozen=True)
class Unit:
    """What U of a corrected rate vector follows from."""

    law: Law
    left: Left
    later: tuple[float, float | None]  #: u of a later power-on, deg/s, and its degrees of freedom
    standards: Sequence[Mapping[str, Any]]
    horizontal_dps: float  #: part of the Earth's rate

    def bound(self, reach_dps: float, temperatures_c: Sequence[float], *, aligned: bool) -> dict[str, float]:
        """Return the largest U of each output over rate vectors; NaN where it is unknown at one of them."""
        found = np.array([
            self.expanded(rates, warm, aligned=aligned)
            for warm in temperatures_c for rates in rate_vectors(reach_dps)
        ])  # fmt: skip
        return dict(zip(self.law.axes, found.max(axis=0).tolist(), strict=True))

    def expanded(self, rates_dps: Array, temperature_c: float, *, aligned: bool) -> list[float]:
        """Return U of each output at a rate vector (3,)."""
        gain = np.linalg.inv(self.law.at(np.array([temperature_c]))[1][0])
        fitted = self.law.u_of_fit(rates_dps, temperature_c, self.left.correlation)
        answer = []
        for k, axis in enumerate(self.law.axes):
            freedom = max(len(self.left.sets.number) - len(self.law.names[axis]), 1)
            model = self.left.model(axis, rates_dps, temperature_c)
            parts = [Part((fitted[k],), freedom=freedom), Part((model,)), Part((self.later[0],), freedom=self.later[1])]
            parts += [self._of_standard(each, k, rates_dps, gain, aligned=aligned) for each in self.standards]
            answer.append(float("nan") if np.isnan(model) else expanded(parts))
        return answer

    def _of_standard(
        self, standard: Mapping[str, Any], k: int, rates_dps: Array, gain: Array, *, aligned: bool
    ) -> Part:  # fmt: skip
        """Return what a reference standard adds to one corrected rate."""
        u, quantity, own = u_of(standard), standard["quantity"], "xyz".index(self.law.axes[k])
        distribution = "normal" if standard["half_width"] is None else standard["distribution"]
        sizes: tuple[float, ...]
        if quantity == "clock":
            sizes = (1e-6 * rates_dps[own] * u,)
        elif quantity in CANCEL:
            sizes = (0.0,)
        elif quantity in ANGLES:
            small = math.radians(u)
            others = [rates_dps[j] for j in range(3) if j != own]
            # of both mountings whose axes a rotation of the frame exchanges, the mean is left of a unit that is aligned
            across = [rate / 2 * small for rate in others for _ in range(2)] if aligned else [r * small for r in others]
            sizes = (*across, math.sqrt(2) * abs(rates_dps[own]) * small**2)
        elif quantity == "level":
            sizes = (math.radians(self.horizontal_dps) * float(gain[k].sum()) * u,)
        else:
            raise ValueError(f"{quantity}: a standard that is not written here; write it")
        return Part(sizes, distribution, standard["freedom"])


def expanded(parts: Sequence[Part]) -> float:
    """Return U of independent contributions, none of which is a known error."""
    variance = sum(part.variance for part in parts)
    freedom = effective_freedom([math.sqrt(part.variance) for part in parts], [part.freedom for part in parts])
    return math.sqrt(variance) * normal_k(parts) * coverage_factor(freedom) / NORMAL_K


def normal_k(parts: Sequence[Part]) -> float:
    """Return the coverage factor by the distributions of all parts, their degrees of freedom taken as infinite.

    The chance that a sum of independent parts is within k of 0 is (2 / pi) times the integral of the product of their
    characteristic functions times sin(k t) / t.
    """
    total = math.sqrt(sum(part.variance for part in parts))
    other = [part for part in parts if part.distribution != "normal"]
    if sum(part.variance for part in other) < NOT_NORMAL * total**2:
        return NORMAL_K
    assert all(part.distribution == "rectangular" for part in other), "a distribution that is not written here"
    normal = math.sqrt(sum(part.variance for part in parts if part.distribution == "normal")) / total
    t = np.linspace(0.0, 12.0 / normal, 40_001)
    product = np.exp(-0.5 * (normal * t) ** 2)
    for size in (size / total for part in other for size in part.sizes_dps):
        product = product * np.sinc(math.sqrt(3) * size * t / math.pi)
    weight = np.full(len(t), t[1])
    weight[0] = weight[-1] = t[1] / 2
    low, high = 0.5, 4.0
    while high - low > 1e-10:
        k = (low + high) / 2
        inside = 2 / math.pi * float(weight @ (product * k * np.sinc(k * t / math.pi)))
        low, high = (k, high) if inside < COVERAGE else (low, k)
    return low
