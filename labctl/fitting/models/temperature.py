"""How temperature enters a model besides the effects that carry it themselves: not at all, or as a table of nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array

if TYPE_CHECKING:
    from labctl.answers.fitted_model import TemperatureBasisJson


@dataclass(frozen=True)
class Constant:
    """One value for all temperatures."""

    def basis(self, temperature_c: Array) -> Array:
        """Return ones, (n, 1)."""
        return np.ones((len(temperature_c), 1))

    def to_dict(self) -> TemperatureBasisJson:
        """Return this as JSON."""
        return {"kind": "constant"}


@dataclass(frozen=True)
class LagrangeTable:
    """A value at each node, and Lagrange interpolation between them (Yang et al. 2018, section 2.3).

    With three points the stencil for T(i-1) < T <= T(i) is T(i-2), T(i-1), T(i); the first interval, which has no node
    to its left, uses the first three. With two points it is linear. Beyond the outer nodes the outermost stencil goes
    on; a Compensator refuses or flags that.
    """

    nodes_c: tuple[float, ...]
    points: int = 3

    def __post_init__(self) -> None:
        if list(self.nodes_c) != sorted(set(self.nodes_c)):
            raise ValueError(f"nodes must rise: {self.nodes_c}")
        if len(self.nodes_c) < self.points:
            raise ValueError(f"{self.points}-point interpolation needs {self.points} nodes, not {len(self.nodes_c)}")

    def basis(self, temperature_c: Array) -> Array:
        """Return the weight of every node, (n, m), for temperatures (n,); each row sums to 1."""
        nodes = np.asarray(self.nodes_c)
        last = np.clip(np.searchsorted(nodes, temperature_c, side="left"), self.points - 1, len(nodes) - 1)
        stencil = last[:, None] + np.arange(1 - self.points, 1)
        weights = lagrange_weights(nodes[stencil], np.asarray(temperature_c, dtype=np.float64))
        full = np.zeros((len(temperature_c), len(nodes)))
        np.put_along_axis(full, stencil, weights, axis=1)
        return full

    def to_dict(self) -> TemperatureBasisJson:
        """Return this as JSON."""
        return {"kind": "lagrange", "points": self.points, "nodes_c": list(self.nodes_c)}


TemperatureBasis = Constant | LagrangeTable


def lagrange_weights(nodes: NDArray[np.float64], at: Array) -> NDArray[np.float64]:
    """Return Lagrange's weights, (n, p), of nodes (n, p) at points (n,)."""
    weights = np.ones_like(nodes)
    p = nodes.shape[1]
    for i in range(p):
        for j in range(p):
            if i != j:
                weights[:, i] *= (at - nodes[:, j]) / (nodes[:, i] - nodes[:, j])
    return weights


def basis_from_dict(record: TemperatureBasisJson) -> TemperatureBasis:
    """Return the basis that `to_dict` described."""
    if record["kind"] == "constant":
        return Constant()
    return LagrangeTable(tuple(record.get("nodes_c", ())), record.get("points", 3))
