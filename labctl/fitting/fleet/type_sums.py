"""Sums over units of what each says of every candidate: all that the criticism of a type needs, and quickly added.

For one coefficient that all units share the sums are sufficient: those of the inner products of the regressors beside
the model, and of their products with the data. The sums of squares say beside that how much units differ: those of
each shape, and those of all shapes together, which show by how much the noise itself is larger than stated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism import CandidateEstimates, EstimatedShape
from labctl.fitting.numeric.arrays import Array

#: Directions of a shape with less than this share of its largest one are left out; and those of all shapes together,
#: whose correlations are kept as 32-bit floats.
MIN_DIRECTION, MIN_OF_ALL = 1e-6, 1e-4


@dataclass
class AxisSums:
    """Sums of one output axis over units, for S shapes with K coefficients side by side."""

    shapes: list[EstimatedShape] = field(default_factory=list)
    places: dict[tuple[str, str, tuple[str, ...]], int] = field(default_factory=dict)  #: key -> number of the shape
    starts: list[int] = field(default_factory=list)  #: (S,) first coefficient of each shape
    units: Array = field(default_factory=lambda: np.zeros(0))  #: (S,) how many units show it
    squares: Array = field(default_factory=lambda: np.zeros(0))  #: (S,) sum of the chi2 that it takes off each unit
    directions: Array = field(default_factory=lambda: np.zeros(0))  #: (S,) of each
    information: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0)))  #: (K, K)
    products: Array = field(default_factory=lambda: np.zeros(0))  #: (K,) information times estimate
    squared_weights: Array = field(default_factory=lambda: np.zeros(0))  #: (K,) sum of 1 / u^4
    whole: float = 0.0  #: sum of the chi2 that all shapes together take off each unit
    all_directions: float = 0.0  #: of all shapes together, sum over the units

    def slice_of(self, shape: int) -> slice:
        """Return the place of the coefficients of a shape."""
        start = self.starts[shape]
        return slice(start, start + len(self.shapes[shape].names))

    def add(
        self, shapes: Sequence[EstimatedShape], z: NDArray[np.float64], u: NDArray[np.float64],
        overlap: NDArray[np.float64],
    ) -> None:  # fmt: skip
        """Add n units of one design: estimates over their uncertainty z (n, K), u (n, K), and `overlap` (K, K)."""
        self._extend(shapes)
        numbers = [self.places[shape.key] for shape in shapes]
        at = np.concatenate([np.zeros(0, dtype=np.int64), *(self._columns(number) for number in numbers)])
        root = 1.0 / u
        self.information[np.ix_(at, at)] += overlap * (root.T @ root)
        self.products[at] += (z * root).sum(axis=0)
        self.squared_weights[at] += (root**4).sum(axis=0)
        begin = 0
        for number, shape in zip(numbers, shapes, strict=True):
            own = slice(begin, begin + len(shape.names))
            values, vectors = np.linalg.eigh(overlap[own, own])
            kept = values > MIN_DIRECTION * values[-1]
            self.squares[number] += float((((z[:, own] @ vectors[:, kept]) ** 2) / values[kept]).sum())
            self.directions[number] = max(self.directions[number], float(kept.sum()))
            self.units[number] += len(z)
            begin = own.stop
        if shapes:
            values, vectors = np.linalg.eigh(overlap)
            kept = values > MIN_OF_ALL * values[-1]
            self.whole += float((((z @ vectors[:, kept]) ** 2) / values[kept]).sum())
            self.all_directions += float(kept.sum()) * len(z)

    def merge(self, other: AxisSums) -> None:
        """Add the sums over other units."""
        self._extend(other.shapes)
        numbers = np.array([self.places[shape.key] for shape in other.shapes], dtype=np.int64)
        at = np.concatenate([np.zeros(0, dtype=np.int64), *(self._columns(number) for number in numbers.tolist())])
        self.information[np.ix_(at, at)] += other.information
        self.products[at] += other.products
        self.squared_weights[at] += other.squared_weights
        self.units[numbers] += other.units
        self.squares[numbers] += other.squares
        self.directions[numbers] = np.maximum(self.directions[numbers], other.directions)
        self.whole += other.whole
        self.all_directions += other.all_directions

    def _columns(self, number: int) -> NDArray[np.int64]:
        own = self.slice_of(number)
        return np.arange(own.start, own.stop)

    def _extend(self, shapes: Sequence[EstimatedShape]) -> None:
        new = [shape for shape in shapes if shape.key not in self.places]
        if not new:
            return
        k, begin = sum(len(shape.names) for shape in new), len(self.products)
        for shape in new:
            self.places[shape.key] = len(self.shapes)
            self.shapes.append(shape)
            self.starts.append(begin)
            begin += len(shape.names)
        self.units, self.squares, self.directions = (
            np.append(each, np.zeros(len(new))) for each in (self.units, self.squares, self.directions)
        )
        self.information = np.pad(self.information, ((0, k), (0, k)))
        self.products, self.squared_weights = (
            np.append(each, np.zeros(k)) for each in (self.products, self.squared_weights)
        )


@dataclass
class TypeSums:
    """Sums over the units of a type, by bench ("": unknown) and output axis."""

    benches: dict[str, dict[str, AxisSums]] = field(default_factory=dict)
    units: int = 0

    @property
    def complete(self) -> bool:
        """Whether the totals of all shapes together are known of every unit."""
        return all(np.isfinite(sums.whole) for axes in self.benches.values() for sums in axes.values())

    def add(self, axes: Mapping[str, CandidateEstimates], bench: str | None = None) -> None:
        """Add one unit, measured on a bench."""
        of_bench = self.benches.setdefault(bench or "", {})
        for axis, each in axes.items():
            sums = of_bench.setdefault(axis, AxisSums())
            sums.add(each.shapes, each.z[None, :], each.u[None, :], each.overlap)
        self.units += 1

    def merge(self, other: TypeSums) -> None:
        """Add the sums over other units, as another process made them."""
        for bench, axes in other.benches.items():
            of_bench = self.benches.setdefault(bench, {})
            for axis, sums in axes.items():
                of_bench.setdefault(axis, AxisSums()).merge(sums)
        self.units += other.units

    def total(self) -> dict[str, AxisSums]:
        """Return the sums over all benches, by axis."""
        axes: dict[str, AxisSums] = {}
        for of_bench in self.benches.values():
            for axis, sums in of_bench.items():
                axes.setdefault(axis, AxisSums()).merge(sums)
        return axes
