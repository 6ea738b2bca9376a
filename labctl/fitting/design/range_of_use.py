"""The range over which a corrected rate vector is to be known: a ball of rates at every temperature between two."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.numeric.arrays import Array

#: Temperatures at which an uncertainty is computed.
TEMPERATURES = 10
#: Shares of the radius: a mean over a ball of three axes is exact for the fourth power of a rate.
GAUSS_RADII = 4


@dataclass(frozen=True)
class RangeOfUse:
    """Rates about the body axes that are turned, up to a largest vector, and temperatures."""

    axes: tuple[str, ...]  #: body axes about which the unit turns in use
    rate_dps: float  #: largest size of the rate vector
    temperature_c: tuple[float, float]
    supply_v: float | None = None  #: in use, where the bench sets it in the calibration

    @cached_property
    def temperatures_c(self) -> Array:
        """The temperatures, (TEMPERATURES,) rising, both ends among them."""
        return np.linspace(*self.temperature_c, TEMPERATURES)

    @cached_property
    def _directions(self) -> tuple[NDArray[np.float64], Array]:
        """Unit vectors (d, axes) and their weights (d,): along the axes and along the diagonals."""
        n = len(self.axes)
        along = np.concatenate([np.eye(n), -np.eye(n)])
        if n == 1:
            return along, np.full(2, 0.5)
        across = np.array(list(product((-1.0, 1.0), repeat=n))) / np.sqrt(n)
        of_axis, of_corner = (1 / 15, 3 / 40) if n == len(BODY_AXES) else (1 / 8, 1 / 8)
        return np.concatenate([along, across]), np.repeat([of_axis, of_corner], [2 * n, 2**n])

    @cached_property
    def vectors(self) -> tuple[NDArray[np.float64], Array]:
        """Rate vectors (v, axes) deg/s, and their weights (v,) in a mean over the ball; those of the surface have 0."""
        n = len(self.axes)
        directions, weights = self._directions
        nodes, shares = np.polynomial.legendre.leggauss(GAUSS_RADII)
        radii = 0.5 * (nodes + 1.0)
        shares = shares * radii ** (n - 1)
        shares = shares / shares.sum()
        inside = [radius * directions for radius in radii.tolist()]
        of_inside = [share * weights for share in shares.tolist()]
        vectors = self.rate_dps * np.concatenate([*inside, directions])
        return vectors, np.concatenate([*of_inside, np.zeros(len(weights))])

    @cached_property
    def points(self) -> tuple[Channels, Array]:
        """Channels of every vector at every temperature, (p,), and the weight of each in the mean."""
        vectors, weights = self.vectors
        warm = np.repeat(self.temperatures_c, len(vectors))
        whole = np.tile(vectors, (TEMPERATURES, 1))
        rates = {axis: whole[:, i] for i, axis in enumerate(self.axes)}
        rates |= {axis: np.zeros(len(warm)) for axis in BODY_AXES if axis not in rates}
        trapezoid = np.ones(TEMPERATURES)
        trapezoid[[0, -1]] = 0.5
        columns: dict[str, NDArray[np.generic]] = {
            "temperature_c": warm, "table_rate_dps": np.linalg.norm(whole, axis=1),
            "position": np.full(len(warm), self.axes[0]),
        }  # fmt: skip
        columns |= {} if self.supply_v is None else {"supply_v": np.full(len(warm), self.supply_v)}
        every = (trapezoid[:, None] * weights[None, :]).ravel()
        return Channels(columns, rates), np.asarray(every / every.sum())
