"""Evidence on one axis of a recording and a planned one together, as a distribution over what the second may give.

With the base eliminated jointly, the products b of the shapes with the data are linear in the data of both recordings.
Those of the first are known. Given one shape with coefficients c as the truth, those of the second are normal: their
mean follows from c and from the base's coefficients, which the first recording leaves uncertain.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.candidate_shape import CandidateShape, slices_of
from labctl.fitting.criticism.candidates import option_of
from labctl.fitting.criticism.evidence.design import Design
from labctl.fitting.criticism.evidence.drawn_shifts import DrawnShifts, reproduced_by_draws, size_average_nats
from labctl.fitting.criticism.evidence.elimination import stack
from labctl.fitting.criticism.evidence.further_coefficients import further_nats
from labctl.fitting.criticism.evidence.gains import MIN_REMAINING
from labctl.fitting.criticism.evidence.noise_grid import factors, whiten
from labctl.fitting.criticism.model_comparison import Comparison, design_of
from labctl.fitting.criticism.planned_addition import variance_of
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.effects import Effect, Term
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.log_evidence import mean_evidence

#: Directions of a base that are seen with less than this share (squared) are taken as not seen.
UNSEEN = 1e-10


@dataclass(frozen=True)
class Known:
    """What recordings say of one shape: it maps products of its columns with the data to coefficients and evidence."""

    factor: NDArray[np.float64]  #: (w, r): |factor.T b|^2 is the gain in chi2, `factor @ factor.T` the covariance
    g: float  #: number of data sets
    drawn: DrawnShifts | None  #: where each coefficient is a draw

    @property
    def directions(self) -> int:
        """The number of directions that are seen."""
        return self.factor.shape[1]

    def gain(self, products: NDArray[np.float64]) -> Array:
        """Return the chi2 (...) that the shape removes, by its products (..., w) with the data."""
        return np.asarray(((products @ self.factor) ** 2).sum(axis=-1))

    def log_bf(self, products: NDArray[np.float64]) -> Array:
        """Return the log Bayes factor (...) by products (..., w) with the data, with the priors of `evidence`."""
        if self.drawn is not None:
            return self.drawn.log_bf(products)
        shrunk = self.g / (1 + self.g)
        return np.asarray(0.5 * self.gain(products) * shrunk - 0.5 * self.directions * np.log1p(self.g))

    def size_nats(self, products: NDArray[np.float64]) -> Array:
        """Return what the log Bayes factor (...) gains where the size is averaged over as that of draws is, nats."""
        gain = self.gain(products)
        if self.drawn is not None:
            return np.zeros_like(gain)
        return size_average_nats(gain, np.full(gain.shape, self.directions), self.g)

    def draw(self, products: Array, n: int, rng: np.random.Generator) -> NDArray[np.float64]:
        """Return n draws, (n, w), of the coefficients as products (w,) with the data leave them."""
        if self.drawn is not None:
            return self.drawn.draw(products, n, rng)
        shrunk = self.g / (1 + self.g)
        mean = shrunk * self.factor @ (self.factor.T @ products)
        root = np.sqrt(shrunk) * _root(self.factor @ self.factor.T)
        return np.asarray(mean + rng.standard_normal((n, len(root))) @ root.T)


@dataclass(frozen=True)
class Shape:
    """One shape: its columns, and what recordings say of it."""

    effect: str
    columns: slice
    now: Known  #: by the first recording
    before: Known  #: the same beside the base of both recordings, in which each recording's bias is free
    after: Known  #: by both recordings
    new: NDArray[np.bool_]  #: (w,) columns that the first recording does not show, as another mounting


@dataclass(frozen=True)
class Fitted:
    """The signal of an effect as it is fitted in one outcome: its shape, coefficients and size in chi2."""

    shape: Shape
    coefficients: Array
    size: float


class AxisForecast:
    """One axis of both recordings."""

    def __init__(self, design: Design, measured: int, whitened: _Whitened, y: Array) -> None:
        self.g = float(measured), float(len(design.t_s))
        base, columns = whitened.base, whitened.columns
        base_now, columns_now = base[whitened.first], columns[whitened.first]
        base_new, columns_new = base[~whitened.first], columns[~whitened.first]
        _, alone = _orthonormal(whitened.alone, whitened.prior_alone)
        alone = alone[: len(y)]
        remaining_now = columns_now - alone @ (alone.T @ columns_now)
        b_now = remaining_now.T @ y
        seen, beside = _orthonormal(base_now, whitened.prior)
        beside = beside[: len(y)]
        left_now = columns_now - beside @ (beside.T @ columns_now)
        _, both = _orthonormal(base, whitened.prior)
        inner = both[: len(base)].T @ columns
        remaining = columns - both[: len(base)] @ inner
        self.gram = remaining.T @ columns
        gram_now, gram_before = remaining_now.T @ columns_now, left_now.T @ columns_now
        norms_now, norms = (columns_now**2).sum(axis=0), (columns**2).sum(axis=0)
        self.shapes = [
            Shape(
                option.candidate,
                place,
                _known(option, gram_now[place, place], norms_now[place], self.g[0]),
                _known(option, gram_before[place, place], norms_now[place], self.g[0]),
                _known(option, self.gram[place, place], norms[place], self.g[1]),
                _new_columns(option, np.diag(gram_now)[place], norms[place]),
            )
            for option, place in zip(design.options, slices_of(design.options), strict=True)
        ]
        remaining_first, remaining_second = remaining[whitened.first], remaining[~whitened.first]
        moved = remaining_second.T @ base_new  # (K, kb): what the base's coefficients do to the products
        through = moved @ seen  # base's coefficients are normal with covariance seen @ seen.T, given the first part
        of_base = seen.T @ base_now.T
        self._known = remaining_first.T @ y + through @ (of_base @ y)
        self._response = remaining_second.T @ columns_new - through @ (of_base @ columns_now)
        self._root = _root(remaining_second.T @ remaining_second + through @ through.T)
        self._b_now, self._b_before = b_now, left_now.T @ y
        rows = [option.rows[0] for option in design.options]
        self._size = np.sqrt(np.mean(np.concatenate(rows, axis=1) ** 2, axis=0)) if rows else np.zeros(0)
        self._of: dict[str, list[Shape]] = {}
        for shape in self.shapes:
            self._of.setdefault(shape.effect, []).append(shape)

    def shapes_of(self, effect: str) -> list[Shape]:
        """Return the shapes of an effect that the first recording shows; none where it does not touch the axis."""
        return [shape for shape in self._of.get(effect, []) if shape.now.directions]

    def _now(self, effect: str) -> Array:
        """Return the log Bayes factor of each shape of an effect by the first recording, (s,) nats."""
        each = [s.now.log_bf(self._b_now[s.columns]) for s in self.shapes_of(effect)]
        return np.array(each, dtype=np.float64)

    def evidence_before(self, effect: str) -> float | None:
        """Return the log evidence for an effect by the first recording beside the base of both; None for no shape.

        It is averaged over the shapes. What is shifts between runs there cannot count for an effect.
        """
        each = [s.before.log_bf(self._b_before[s.columns]) for s in self.shapes_of(effect)]
        return float(mean_evidence(each, len(each))) if each else None

    def draw(self, effect: str, n: int, rng: np.random.Generator) -> Outcomes:
        """Return n outcomes where an effect is the cause, its shape and size as the first recording leaves them."""
        k = len(self._known)
        products = np.tile(self._known, (n, 1)) + rng.standard_normal((n, k)) @ self._root.T
        shapes, now = self.shapes_of(effect), self._now(effect)
        if shapes:
            chosen = rng.choice(len(shapes), n, p=np.exp(now - np.logaddexp.reduce(now)))
            for i, shape in enumerate(shapes):
                rows = np.flatnonzero(chosen == i)
                coefficients = shape.now.draw(self._b_now[shape.columns], len(rows), rng)
                products[rows] += self._with_new(shape, coefficients, rng) @ self._response[:, shape.columns].T
        return Outcomes(self, products)

    @staticmethod
    def _with_new(shape: Shape, coefficients: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
        """Return coefficients (n, w), those of mountings still to come drawn with the size of those that were seen."""
        if shape.now.drawn is None and np.any(shape.new) and not np.all(shape.new):
            size = np.sqrt(np.mean(coefficients[:, ~shape.new] ** 2, axis=1, keepdims=True))
            coefficients[:, shape.new] = size * rng.standard_normal((len(coefficients), int(shape.new.sum())))
        return coefficients

    def reproduced(self, fitted: Fitted, rival: str, outcomes: Outcomes, k: int) -> tuple[float, int]:
        """Return the part of a fitted signal, in chi2, that a rival's best shape reproduces, and how many more
        directions the rival has."""
        best = outcomes.best(rival, k)
        if best is None:
            return 0.0, -fitted.shape.after.directions
        inner = self.gram[best.columns, fitted.shape.columns] @ fitted.coefficients
        return float(best.after.gain(inner)), best.after.directions - fitted.shape.after.directions

    def reproduced_by_draws(self, fitted: Fitted, drawn: str, outcomes: Outcomes, k: int) -> float:
        """Return the part of a fitted signal, in chi2, that as many draws of a shift reproduce as it has
        coefficients."""
        best = outcomes.best(drawn, k)
        if best is None:
            return 0.0
        inner = self.gram[best.columns, fitted.shape.columns] @ fitted.coefficients
        return reproduced_by_draws(self.gram[best.columns, best.columns], inner, fitted.shape.after.directions)

    def further_nats(self, fitted: Fitted, rival: str, outcomes: Outcomes, k: int) -> float:
        """Return the evidence against the coefficients that a rival has beyond a fitted signal, nats."""
        best = outcomes.best(rival, k)
        if best is None:
            return 0.0
        covariance = best.after.factor @ best.after.factor.T
        through = covariance @ self.gram[best.columns, fitted.shape.columns]
        values = outcomes.coefficients(best, k)
        return further_nats(values, covariance, through, fitted.coefficients, self._size[best.columns])


class Outcomes:
    """Outcomes of one axis: products of the shapes with the data of both recordings, (n, K)."""

    def __init__(self, axis: AxisForecast, products: NDArray[np.float64]) -> None:
        self._axis, self._products = axis, products
        self._known: dict[str, NDArray[np.float64]] = {}
        self._best: dict[str, list[int]] = {}

    def _shapes(self, effect: str) -> NDArray[np.float64]:
        """Return the log Bayes factor of each shape of an effect by both recordings, (s, n) nats."""
        if effect not in self._known:
            self._known[effect] = np.array([
                s.after.log_bf(self._products[:, s.columns])
                for s in self._axis.shapes_of(effect)
            ])  # fmt: skip
        return self._known[effect]

    def evidence(self, effect: str) -> Array | None:
        """Return the log evidence for an effect by both recordings, (n,) nats; None where it is not on the axis."""
        each = self._shapes(effect)
        return mean_evidence(each, len(each)) if len(each) else None

    def evidence_of_sizes(self, effect: str) -> Array | None:
        """Return the same where the size of the effect is averaged over as that of draws is, (n,) nats."""
        each = self._shapes(effect)
        if not len(each):
            return None
        of_sizes = [s.after.size_nats(self._products[:, s.columns]) for s in self._axis.shapes_of(effect)]
        return mean_evidence(each + np.array(of_sizes), len(each))

    def best(self, effect: str, k: int) -> Shape | None:
        """Return the shape of an effect with the most evidence in outcome `k`."""
        if effect not in self._best:
            each = self._shapes(effect)
            self._best[effect] = np.argmax(each, axis=0).tolist() if len(each) else []
        numbers = self._best[effect]
        return self._axis.shapes_of(effect)[numbers[k]] if numbers else None

    def fitted(self, effect: str, k: int) -> Fitted | None:
        """Return the signal of an effect as it is fitted in outcome `k`, in its best shape."""
        best = self.best(effect, k)
        if best is None:
            return None
        inner = best.after.factor.T @ self._products[k, best.columns]
        return Fitted(best, best.after.factor @ inner, float(inner @ inner))

    def coefficients(self, shape: Shape, k: int) -> Array:
        """Return the coefficients, (w,), with which a shape is fitted in outcome `k`."""
        factor = shape.after.factor
        return np.asarray(factor @ (factor.T @ self._products[k, shape.columns]))


@dataclass(frozen=True)
class _Whitened:
    base: NDArray[np.float64]  #: (rows, kb)
    columns: NDArray[np.float64]  #: (rows, K) of all shapes
    first: NDArray[np.bool_]  #: (rows,) whether a row is of the first recording
    prior: Array  #: (kb,) root of the prior precision
    alone: NDArray[np.float64]  #: (rows of the first, ka): the base of the first recording by itself
    prior_alone: Array  #: (ka,)


def forecast_axis(
    data: ReducedRecording, comparison: Comparison, planned: ReducedRecording, axis: str,
    catalogue: Mapping[str, Effect],
) -> AxisForecast:  # fmt: skip
    """Return the forecast of one axis: `data` are those of `comparison` and behind them the planned ones."""
    design = design_of(data, comparison.model, axis, catalogue, smooth=False)
    options = [*design.options, *_rivals_at_same_parameters(data, design, comparison, axis, catalogue)]
    design = replace(design, options=options)
    measured = len(comparison.data)
    white, scale = _noise(comparison, planned, axis, len(data.present))
    blocks, _ = factors(comparison.axes[axis].best.noise, white, design.t_s, design.run)

    def rows(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate([whiten(blocks, values[0]), stack(values, scale, design.present)])

    columns = np.concatenate([o.rows for o in options], axis=2) if options else np.zeros((*design.present.shape, 0))
    is_first = np.broadcast_to(np.arange(len(data)) < measured, design.present.shape)
    first = np.concatenate([is_first[0], is_first[1:][design.present[1:]]])
    y = rows(data.error_dps(axis)[:, :, None])[:, 0][first]
    own = comparison.designs[axis]
    alone = rows(_grown(own.base, design.present.shape))[first]
    return AxisForecast(
        design,
        measured,
        _Whitened(rows(design.base), rows(columns), first, np.sqrt(design.precision), alone, np.sqrt(own.precision)),
        y,
    )


def _rivals_at_same_parameters(
    data: ReducedRecording, design: Design, comparison: Comparison, axis: str, catalogue: Mapping[str, Effect]
) -> list[CandidateShape]:
    """Return further shapes of each effect: with the nonlinear parameters at which another effect is tried.

    A criticism refines the shape of rivals. On grids of their own, two effects with a time constant each would differ
    by their grids alone.
    """
    terms = [option.term for option in design.options if option.term is not None]
    tried = {_shape_key(term) for term in terms}
    shapes = []
    for term in terms:
        kind = catalogue[term.effect]
        ranges = {parameter.name: (parameter.low, parameter.high) for parameter in kind.parameters}
        for other in terms:
            if other.effect == term.effect or not ranges or set(other.parameters) != set(term.parameters):
                continue
            moved = replace(term, parameters=other.parameters)
            inside = all(ranges[name][0] <= value <= ranges[name][1] for name, value in moved.parameters.items())
            if not inside or _shape_key(moved) in tried:
                continue
            tried.add(_shape_key(moved))
            if (shape := option_of(data, axis, comparison.model.reference, kind, moved)) is not None:
                shapes.append(shape)
    return shapes


def _shape_key(term: Term) -> tuple[object, ...]:
    return term.effect, term.order, *sorted((name, f"{value:.4g}") for name, value in term.parameters.items())


def _grown(base: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return the base (R, m, k) of a recording with zeros in the coordinates and data sets that it does not have."""
    grown = np.zeros((*shape, base.shape[2]))
    grown[: base.shape[0], : base.shape[1]] = base
    return grown


def _noise(
    comparison: Comparison, planned: ReducedRecording, axis: str, coordinates: int
) -> tuple[Array, NDArray[np.float64]]:
    """Return the white variance of each mean, (m + k,), and the scale of the other coordinates, (R, m + k)."""
    white, scale = comparison.white_var[axis], comparison.scales[axis]
    planned_white = variance_of(comparison.data, planned, white)
    ratio = np.ones(coordinates)
    ratio[: len(scale)] = np.median(scale / np.sqrt(white), axis=1)
    grown = np.concatenate([scale, np.repeat(np.sqrt(white)[None, :], coordinates - len(scale), axis=0)])
    return (
        np.concatenate([white, planned_white]),
        np.concatenate([grown, ratio[:, None] * np.sqrt(planned_white)[None, :]], axis=1),
    )


def _orthonormal(base: NDArray[np.float64], prior: Array) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the root (kb, r) of the covariance of the base's coefficients, and an orthonormal basis of its columns.

    The basis, (rows + kb, r), has the prior as rows of its own below. Directions that are not seen have no part.
    """
    whole = np.concatenate([base, np.diag(prior)])
    size = np.linalg.norm(whole, axis=0)
    size = np.where(size > 0, size, 1.0)
    scaled = whole / size
    values, vectors = np.linalg.eigh(scaled.T @ scaled)  # one array twice is half the work
    kept = values > UNSEEN * max(float(values[-1]), 1e-300) if len(values) else np.zeros(0, dtype=bool)
    root = vectors[:, kept] / np.sqrt(values[kept]) / size[:, None]
    return root, whole @ root


def _known(option: CandidateShape, gram: NDArray[np.float64], squared_norms: Array, g: float) -> Known:
    """Return what a shape's Gram matrix (w, w), base eliminated, says of it, in the directions that are seen.

    `squared_norms` (w,) are those of its columns before, and `g` is the number of data sets.
    """
    size = np.sqrt(np.maximum(squared_norms, 1e-300))
    values, vectors = np.linalg.eigh(gram / np.outer(size, size))
    kept = values > MIN_REMAINING
    factor = np.asarray(vectors[:, kept] / np.sqrt(values[kept]) / size[:, None])
    return Known(factor, g, DrawnShifts.of(gram, g) if option.is_drawn else None)


def _new_columns(option: CandidateShape, seen_now: Array, norms: Array) -> NDArray[np.bool_]:
    """Return of which columns of a shape the first recording shows nothing, (w,); none where their units differ."""
    return np.full(len(norms), len(set(option.units)) == 1) & (seen_now <= UNSEEN * norms)


def _root(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the root (K, K) of a covariance that may be singular, of the two sides the same.

    Equal variances leave the eigenvectors open, to be rotated by rounding; that root they do not rotate, so the same
    numbers are drawn on every machine.
    """
    size = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / np.outer(size, size))
    return np.asarray(size[:, None] * (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)
