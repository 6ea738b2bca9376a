"""What the places of a record share: the error of its rests, and of the turns between them.

Iron and currents near a unit change the field from place to place. While it lies still, its place does not change: all
readings of a rest share one error. From rest to rest it is turned by hand, and the error goes from one place's to the
next's, with what the way adds: nothing at both ends, most in the middle (a Brownian bridge).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.sparse import coo_array, csr_array, eye_array

from labctl.fitting.numeric.arrays import Array

#: Places into which a record is divided, unless it has more rests and turns than that: the likelihood takes the cube
#: of their number.
MAX_PLACES = 400


@dataclass(frozen=True)
class Places:
    """The places of a record in order of time: its rests, and the pieces of the turns between them."""

    number: NDArray[np.int64]  #: (n,) place of each reading, from 0
    of_rests: csr_array  #: (k, r) share of each rest's error in that of a place
    on_way: csr_array  #: (k, k) covariance of what the ways add: 1/4 in the middle of a usual one

    @staticmethod
    def of(rest: NDArray[np.int64]) -> Places:
        """Return those of readings (n,) that are in a rest, from 1, or in none, 0."""
        begins = np.concatenate([[True], rest[1:] != rest[:-1]])
        stretch = np.cumsum(begins) - 1
        length = np.bincount(stretch)
        is_turn = rest[begins] == 0
        within = np.arange(len(rest)) - np.flatnonzero(begins)[stretch]
        piece = -(-int(length[is_turn].sum()) // max(MAX_PLACES - len(length), 1))  # readings
        begins |= (rest == 0) & (within % max(piece, 1) == 0)
        number = np.cumsum(begins) - 1
        share = (np.bincount(number, within) / np.bincount(number) + 0.5) / length[stretch[begins]]
        return Places(number, *_along(stretch[begins], share, np.where(is_turn, length, 0)))

    @cached_property
    def parts(self) -> tuple[csr_array, csr_array]:
        """The covariances (k, k) of the places' errors by a variance of 1 of each rest, and of each way."""
        return csr_array(self.of_rests @ self.of_rests.T), self.on_way

    def kept(self, readings: NDArray[np.int64]) -> Places:
        """Return those of some of the readings, by their numbers in the record."""
        kept, number = np.unique(self.number[readings], return_inverse=True)
        return Places(number, self.of_rests[kept], self.on_way[kept][:, kept])


def _along(stretch: NDArray[np.int64], share: Array, turned: NDArray[np.int64]) -> tuple[csr_array, csr_array]:
    """Return `of_rests` (k, r) and `on_way` (k, k) of places on stretches, at shares of them.

    `turned` (s,) are the readings of each stretch in motion, 0 of a rest. A way before the first rest or after the last
    one has one end: what it adds grows with the distance from that.
    """
    rests, places = np.flatnonzero(turned == 0), np.arange(len(stretch))
    after = np.searchsorted(rests, stretch)  # of a rest: itself
    before = np.maximum(after - (turned[stretch] > 0), 0)
    ends = np.concatenate([before, np.minimum(after, len(rests) - 1)])
    shares = (np.concatenate([1 - share, share]), (np.tile(places, 2), ends))
    of_rests = coo_array(shares, shape=(len(places), len(rests))).tocsr()
    ways = turned / max(turned.sum() / max(np.count_nonzero(turned), 1), 1.0)  # 1 of one of usual length
    count = np.bincount(stretch)[stretch]  # of the places on the stretch of each
    one = np.repeat(places, count)
    other = np.arange(len(one)) - np.repeat(np.cumsum(count) - count - np.searchsorted(stretch, stretch), count)
    s = np.where(stretch < rests[0], 1 - share, share)
    one_end = (stretch < rests[0]) | (stretch > rests[-1])
    bridge = np.minimum(s[one], s[other]) * np.where(one_end[one], 1.0, 1 - np.maximum(s[one], s[other]))
    on_way = coo_array((ways[stretch[one]] * bridge, (one, other)), shape=(len(places), len(places))).tocsr()
    return of_rests, on_way


@dataclass(frozen=True)
class Weights:
    """The inverse of V = 1 + Z S Z^T, Z (n, k) 1 for the readings of a place: what weighs readings by their places.

    With N = Z^T Z and B = 1 + N^1/2 S N^1/2 it is 1 - Z N^-1/2 (1 - B^-1) N^-1/2 Z^T (Woodbury), and det V = det B.
    """

    places: Places
    root: Array  #: (k,) of the readings of each place
    factor: NDArray[np.float64]  #: of B, by Cholesky, in bands: only places near each other share errors

    @staticmethod
    def of(places: Places, ratios: Array) -> Weights:
        """Return them by the variances of rests and of ways over that of a reading, (2,)."""
        root = np.sqrt(np.bincount(places.number))
        of_rests, on_way = places.parts
        covariance = (ratios[0] * of_rests + ratios[1] * on_way).multiply(root[:, None]).multiply(root)
        whole = (covariance + eye_array(len(root))).tocoo()
        below = whole.row - whole.col
        banded = np.zeros((int(below.max(initial=0)) + 1, len(root)))
        lower = below >= 0
        banded[below[lower], whole.col[lower]] = whole.data[lower]
        return Weights(places, root, cholesky_banded(banded, lower=True))

    def solve(self, columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return B^-1 columns (k, p)."""
        return np.asarray(cho_solve_banded((self.factor, True), columns))

    def sums(self, columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return N^-1/2 Z^T columns (k, p) of columns (n, p)."""
        of_each = [np.bincount(self.places.number, column) for column in columns.T]
        return np.asarray(np.array(of_each).T / self.root[:, None])

    def product(self, columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return columns^T V^-1 columns (p, p)."""
        return self.product_of(columns.T @ columns, self.sums(columns))

    def product_of(self, whole: NDArray[np.float64], sums: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the same of columns^T columns (p, p) and the `sums` of the columns."""
        return np.asarray(whole - sums.T @ sums + sums.T @ self.solve(sums))

    @property
    def log_determinant(self) -> float:
        return 2 * float(np.sum(np.log(self.factor[0])))
