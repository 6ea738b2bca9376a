"""Evidence for an effect whose coefficients are draws: a shift for each powered run, or for each mounting.

Of such an effect only the standard deviation of the draws is a quantity of the unit or of its fixture. Given that, the
coefficients are normal and are integrated out; the standard deviation is averaged over. A price for each coefficient,
as effects with fixed coefficients pay, would grow with the number of runs, and would not ask whether the shifts of
one recording are of the size of those of another.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array

#: Standard deviations that are averaged over, evenly spaced in logarithms.
SIZES = 12
#: Directions of which less than this share of the best seen one is known are taken as not seen.
UNSEEN = 1e-12


@dataclass(frozen=True)
class DrawnShifts:
    """Directions in which shifts are seen, and the variances of their draws to average over.

    The coefficients of an option are the shifts less the first one, which is a draw too.
    """

    root: NDArray[np.float64]  #: (w, w) from an amplitude of variance 1 in each direction to the coefficients
    directions: NDArray[np.float64]  #: (w, w) orthonormal, of draws of variance 1, one in each column
    known: Array  #: (w,) what is known of each amplitude, 1/(deg/s)^2 for a coefficient in deg/s; 0: nothing
    variances: Array  #: (s,) of the draws

    @staticmethod
    def of(gram: NDArray[np.float64], g: float) -> DrawnShifts:
        """Return those of a Gram matrix (w, w) of whitened columns, base eliminated.

        The smallest standard deviation is as large as noise in the direction that is seen best. The largest is that of
        the unit-information prior with which effects with fixed coefficients compete: sqrt(g) times as large.
        """
        draws = np.eye(len(gram)) + 1.0  # covariance of shifts less the first, for draws of variance 1
        factor = np.linalg.cholesky(draws)
        known, vectors = np.linalg.eigh(factor.T @ gram @ factor)
        best = float(known.max(initial=0.0))
        seen = known > max(UNSEEN * best, 0.0)
        variances = np.geomspace(1.0, max(g, 1.0), SIZES) / best if np.any(seen) else np.zeros(1)
        root = np.asarray(factor @ vectors, dtype=np.float64)
        return DrawnShifts(root, np.asarray(vectors), np.where(seen, known, 0.0), variances)

    def log_bf(self, products: NDArray[np.float64]) -> Array:
        """Return the log Bayes factor (...) against the base for products (..., w) of the columns with the data."""
        return np.asarray(np.logaddexp.reduce(self._log_bf_by_size(products), axis=-1) - np.log(len(self.variances)))

    def draw(self, products: Array, n: int, rng: np.random.Generator) -> NDArray[np.float64]:
        """Return n draws, (n, w), of the coefficients as products (w,) of the columns with the data leave them.

        Their standard deviation is drawn first. Shifts that the data do not show, as those still to come, have it.
        """
        log_p = self._log_bf_by_size(products)
        variance = rng.choice(self.variances, n, p=np.exp(log_p - np.logaddexp.reduce(log_p)))[:, None]
        left = variance / (1.0 + variance * self.known)
        # directions that are known alike are open, to be rotated by rounding: what is drawn does not depend on them
        scatter = rng.standard_normal((n, len(self.known))) @ self.directions
        amplitudes = left * self._amplitudes(products) + np.sqrt(left) * scatter
        return np.asarray(amplitudes @ self.root.T)

    def _amplitudes(self, products: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.where(self.known > 0, products @ self.root, 0.0)

    def _log_bf_by_size(self, products: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the log Bayes factor for each standard deviation, (..., s)."""
        spread = 1.0 + self.variances[:, None] * self.known  # (s, w)
        gain = self._amplitudes(products) ** 2 @ (self.variances[:, None] / spread).T  # (..., s)
        return np.asarray(0.5 * gain - 0.5 * np.log(spread).sum(axis=1))


def size_average_nats(gain: Array, directions: NDArray[np.int64], g: float) -> Array:
    """Return what the evidence for fixed coefficients gains if their size is averaged over as that of draws is, nats.

    `gain` (...) in chi2 is what they remove in `directions` (...), and `g` the number of data sets. Their
    unit-information prior is the largest size of `DrawnShifts.of`: with it alone, odds against draws would come from
    the priors (Liang et al., J. Am. Stat. Assoc. 103, 410, 2008, on a fixed g).
    """
    by_g = np.geomspace(1.0, max(g, 1.0), SIZES)
    log_bf = 0.5 * np.multiply.outer(gain, by_g / (1 + by_g)) - 0.5 * np.multiply.outer(directions, np.log1p(by_g))
    return np.asarray(np.logaddexp.reduce(log_bf, axis=-1) - np.log(SIZES) - log_bf[..., -1])


def reproduced_by_draws(gram: NDArray[np.float64], inner: Array, number: int) -> float:
    """Return the part of a signal, in chi2, that so many draws reproduce while all others are equal.

    `gram` (w, w) are the inner products of the columns of the shifts less the first, whitened, base eliminated, and
    `inner` (w,) those with the signal. The draws are taken one after the other, the one that reproduces most first.
    """
    # the last draw is that of the first run or mounting: all others less it
    draws = np.concatenate([np.eye(len(inner)), np.ones((len(inner), 1))], axis=1)
    left, products = draws.T @ gram @ draws, draws.T @ inner
    least, part = UNSEEN * float(np.diag(left).max(initial=0.0)), 0.0
    for _ in range(number):
        known = np.diag(left)
        is_seen = known > max(least, 0.0)
        each = np.where(is_seen, products**2 / np.where(is_seen, known, 1.0), 0.0)
        best = int(np.argmax(each))
        if not each[best] > 0:
            break
        part += float(each[best])
        along = left[best] / known[best]
        products = products - along * products[best]
        left = left - np.outer(along, left[best])
    return part
