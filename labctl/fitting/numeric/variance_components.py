"""Variance components: how much what is shared by a group of data differs from group to group, beside a linear fit.

Given the triangle of a fit whose last columns are random effects under a wide prior, the standard deviation of each
kind of effect is averaged over by its restricted likelihood, with equal weight per factor of its size. For two groups
that gives the interval of Student's t with one degree of freedom, as it must: two draws say little of a spread.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, ndtr

from labctl.fitting.numeric.arrays import Array

#: Standard deviations tried for each kind: so many, from this share of the standard uncertainty of an effect ...
SIZES, LEAST = 18, 0.1
#: ... (or their spread over IMPOSSIBLE, if that is less) to MOST times the larger of that uncertainty and their spread.
MOST, IMPOSSIBLE = 200.0, 30.0
#: Points that together hold less than this share of the evidence are left out.
NEGLIGIBLE = 1e-4
#: Probability of an interval, and its half width over the standard deviation of a normal distribution.
COVERAGE_PROBABILITY, FACTOR = 0.95, 1.959963984540054
BISECTIONS = 40


@dataclass(frozen=True)
class RandomEffects:
    """The last q columns of a design: the kind of each from 0, and the standard deviation of its prior, (q,) each."""

    kind: NDArray[np.int64]
    wide: Array

    @property
    def kinds(self) -> int:
        """How many kinds there are."""
        return int(self.kind.max(initial=-1)) + 1


@dataclass(frozen=True)
class Component:
    """Standard deviation of one kind of random effect, in the unit of its coefficients."""

    value: float  #: median of what is believed of it
    u: float  #: half of its central 68 %
    low: float  #: 95 %, from
    high: float  #: to
    groups: int  #: independent effects that it was estimated from, less those that the fit uses
    p_value: float  #: of effects as large as these from noise alone


@dataclass(frozen=True)
class Triangles:
    """A linear fit at d noises, as triangles: r (d, K, K), projected data (d, K), noise scale and log evidence (d,)."""

    r: NDArray[np.float64]
    projected: NDArray[np.float64]
    scale: Array
    log_evidence: Array


@dataclass(frozen=True)
class Mixture:
    """Coefficients of the fixed columns and of the random effects, (K,), averaged, and the spread of each kind.

    The covariance (K, K) has for each coefficient the half width of its 95 % interval over 1.96 as its standard
    uncertainty: few groups make wide tails, which a standard deviation does not tell.
    """

    values: Array
    covariance: NDArray[np.float64]
    components: tuple[Component, ...]


@dataclass(frozen=True)
class _Information:
    """What the data of one noise say of the random effects: information (q, q) and its product with them (q,)."""

    matrix: NDArray[np.float64]
    product: Array


def mixture(triangles: Triangles, random: RandomEffects) -> Mixture:
    """Return the fit averaged over noise and over the standard deviations of the random effects."""
    q = len(random.kind)
    k = triangles.r.shape[1] - q
    at = [_information(triangles, d, k, random) for d in range(len(triangles.scale))]
    best = int(np.argmax(triangles.log_evidence))
    grid = _grid(at[best], random)
    log_weight = np.stack([_log_likelihood(each, grid) for each in at])
    wide = np.array([_log_likelihood(each, np.asarray(random.wide)[None, :])[0] for each in at])
    log_weight += (np.asarray(triangles.log_evidence) - wide)[:, None]
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    values, spreads, shares = [], [], []
    covariance: NDArray[np.float64] = np.zeros((k + q, k + q))
    for d, information in enumerate(at):
        chosen = _counting(weight[d])
        if not len(chosen):
            continue
        inverse = np.linalg.inv(information.matrix + np.apply_along_axis(np.diag, 1, grid[chosen] ** -2.0))
        effects = inverse @ information.product
        root = np.linalg.inv(triangles.r[d, :k, :k]) * np.sqrt(triangles.scale[d])
        gain = np.linalg.solve(triangles.r[d, :k, :k], triangles.r[d, :k, k:])
        fixed = np.linalg.solve(triangles.r[d, :k, :k], triangles.projected[d, :k]) - effects @ gain.T
        lever = np.vstack([-gain, np.eye(q)])
        conditional = np.zeros((k + q, k + q))
        conditional[:k, :k] = root @ root.T
        share = weight[d, chosen]
        mean_inverse = np.tensordot(share, inverse, axes=1)
        covariance += share.sum() * conditional + lever @ mean_inverse @ lever.T
        values.append(np.column_stack([fixed, effects]))
        variance = np.einsum("ki,nij,kj->nk", lever, inverse, lever) + np.diag(conditional)
        spreads.append(np.sqrt(np.maximum(variance, 0.0)))
        shares.append(share)
    each, spread, share = np.concatenate(values), np.concatenate(spreads), np.concatenate(shares)
    share = share / share.sum()
    mean = share @ each
    covariance += (each - mean).T @ (share[:, None] * (each - mean))
    u = half_width(each, spread, share, mean) / FACTOR
    stretch = u / np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    components = tuple(_component(kind, grid, weight.sum(axis=0), at[best], random) for kind in range(random.kinds))
    return Mixture(mean, stretch[:, None] * covariance * stretch, components)


def half_width(
    values: NDArray[np.float64],
    spreads: NDArray[np.float64],
    share: Array,
    centre: Array,
    probability: float = COVERAGE_PROBABILITY,
) -> Array:
    """Return the half width (k,) about `centre` (k,) with `probability` of n normal distributions (n, k) by `share`."""
    low = np.zeros(len(centre))
    high = np.max(np.abs(values - centre) + 8.0 * spreads, axis=0)
    off, spreads = values - centre, np.maximum(spreads, 1e-300)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        inside = share @ (ndtr((middle - off) / spreads) - ndtr((-middle - off) / spreads))
        enough = inside >= probability
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    return np.asarray((low + high) / 2)


def _information(triangles: Triangles, d: int, k: int, random: RandomEffects) -> _Information:
    """Return the information on the random effects with the fixed coefficients eliminated and without the prior."""
    block = triangles.r[d, k:, k:]
    matrix = (block.T @ block - np.diag(np.asarray(random.wide) ** -2.0)) / triangles.scale[d]
    return _Information((matrix + matrix.T) / 2, np.asarray(block.T @ triangles.projected[d, k:] / triangles.scale[d]))


def _grid(information: _Information, random: RandomEffects) -> NDArray[np.float64]:
    """Return standard deviations of each effect to average over, (n, q): all combinations of those of the kinds."""
    inverse = np.linalg.inv(information.matrix + np.diag(np.asarray(random.wide) ** -2.0))
    effects = inverse @ information.product
    sizes = []
    for kind in range(random.kinds):
        of_kind = random.kind == kind
        uncertain = float(np.median(1.0 / np.sqrt(np.maximum(np.diag(information.matrix)[of_kind], 1e-300))))
        spread = _spread(effects[of_kind])
        largest = min(float(np.max(np.asarray(random.wide)[of_kind])), MOST * max(spread, uncertain))
        least = min(max(LEAST * uncertain, spread / IMPOSSIBLE), largest / 10)
        sizes.append(np.geomspace(least, largest, SIZES))
    points = np.stack(np.meshgrid(*sizes, indexing="ij"), axis=-1).reshape(-1, random.kinds)
    return np.asarray(points[:, random.kind])


def _spread(effects: Array) -> float:
    return float(np.sqrt(np.sum((effects - effects.mean()) ** 2) / max(len(effects) - 1, 1)))


def _log_likelihood(information: _Information, grid: NDArray[np.float64]) -> Array:
    """Return the restricted log likelihood of each point of a grid (n, q), (n,), but for what all points share."""
    matrix = information.matrix + np.apply_along_axis(np.diag, 1, grid**-2.0)
    _, log_det = np.linalg.slogdet(matrix)
    explained = np.einsum("i,ni->n", information.product, np.linalg.solve(matrix, information.product))
    return np.asarray(-np.log(grid).sum(axis=1) - 0.5 * log_det + 0.5 * explained)


def _counting(weight: Array) -> NDArray[np.int64]:
    """Return the points that hold all of the evidence but a negligible share."""
    return np.flatnonzero(weight > NEGLIGIBLE / len(weight))


def _component(
    kind: int, grid: NDArray[np.float64], weight: Array, information: _Information, random: RandomEffects
) -> Component:
    of_kind = random.kind == kind
    sizes, place = np.unique(grid[:, np.flatnonzero(of_kind)[0]], return_inverse=True)
    share = np.bincount(place, weight)
    middles = np.cumsum(share) - share / 2
    low, lower, value, upper, high = np.exp(np.interp([0.025, 0.16, 0.5, 0.84, 0.975], middles, np.log(sizes)))
    chi2, groups = _scatter(information, of_kind, random)
    p_value = float(chdtrc(groups, chi2)) if groups else 1.0
    return Component(float(value), float(upper - lower) / 2, float(low), float(high), groups, p_value)


def _scatter(information: _Information, rows: NDArray[np.bool_], random: RandomEffects) -> tuple[float, int]:
    """Return chi2 of the effects of one kind with the others free, and its degrees of freedom."""
    other_rows = ~rows
    matrix, product = information.matrix[np.ix_(rows, rows)], information.product[rows]
    if other_rows.any():
        crossed = information.matrix[np.ix_(rows, other_rows)]
        others = information.matrix[np.ix_(other_rows, other_rows)] + np.diag(
            np.asarray(random.wide)[other_rows] ** -2.0
        )
        matrix = matrix - crossed @ np.linalg.solve(others, crossed.T)
        product = product - crossed @ np.linalg.solve(others, information.product[other_rows])
    sizes, vectors = np.linalg.eigh(matrix)
    is_seen = sizes > 1e-6 * max(float(sizes.max()), 1e-300)
    along = vectors[:, is_seen].T @ product
    return float(np.sum(along**2 / sizes[is_seen])), int(is_seen.sum())
