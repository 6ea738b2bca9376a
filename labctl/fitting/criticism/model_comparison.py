"""From a compressed recording and a model to the evidence for everything that may be missing, over all axes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from labctl.fitting.criticism.candidates import Option, base_rows, options_of
from labctl.fitting.criticism.evidence import AxisEvidence, Design, eliminate_base, evidence, gains_of, solve_option
from labctl.fitting.criticism.noise_grid import Noise, noise_grid
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.effects import CATALOGUE, Effect, Term
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.numeric.arrays import Array

#: From this evidence on, the scatter of the coordinates is estimated again without what the leader explains.
SECOND_LOOK = 6.0
ROBUST = 1.4826
#: A formula of which the base leaves less than this has nothing of its own.
LEAST_APART = 1e-5


@dataclass(frozen=True)
class Candidate:
    """One candidate over all axes."""

    id: str
    smooth: bool
    log_bf: float
    option: Mapping[str, int]  #: axis -> the option that speaks most for it
    term: Term | None  #: the shape that fits all axes together best
    gain: float  #: chi2 that it takes off, over all axes


@dataclass(frozen=True)
class Comparison:
    """Everything that was weighed."""

    data: ReducedRecording
    model: ErrorModel
    designs: Mapping[str, Design]
    axes: Mapping[str, AxisEvidence]
    white_var: Mapping[str, Array]
    scales: Mapping[str, NDArray[np.float64]]
    candidates: tuple[Candidate, ...]  #: best first
    extra: tuple[tuple[str, Term], ...] = ()  #: what was added to the model's base

    def leader(self, *, smooth: bool) -> Candidate | None:
        """Return the best catalogue effect, or the best smooth channel."""
        return next((c for c in self.candidates if c.smooth == smooth), None)


def design_of(
    data: ReducedRecording, model: ErrorModel, axis: str, catalogue: Mapping[str, Effect] = CATALOGUE
) -> Design:
    """Return everything about one axis that does not depend on its output."""
    base, _, precision = base_rows(data, model, axis)
    nodes = data.nodes
    t_s = 75.0 * np.arange(len(data), dtype=np.float64)
    if "t_s" in nodes:
        t_s = data.at_sets(np.asarray(nodes["t_s"], dtype=np.float64))
    run = data.at_sets(np.asarray(nodes["run"] if "run" in nodes else np.ones(len(nodes)), dtype=np.float64))
    level = level_of(base, data)
    options = [
        apart(centred(option, level), base[:, :, precision == 0])
        for option in options_of(data, axis, model.reference, catalogue)
    ]
    return Design(base, precision, options, data.present, t_s, np.rint(run).astype(np.int64))


def weigh_beside(weighed: Comparison, model: ErrorModel, catalogue: Mapping[str, Effect] = CATALOGUE) -> Comparison:
    """Weigh everything again beside a model with other terms: the same candidates, another base."""
    designs = {}
    for axis, design in weighed.designs.items():
        base, _, precision = base_rows(weighed.data, model, axis)
        designs[axis] = replace(design, base=base, precision=precision)
    return compare_models(weighed.data, model, catalogue, designs)


def level_of(base: NDArray[np.float64], data: ReducedRecording) -> NDArray[np.float64] | None:
    """Return the coordinates of a constant, (R, m), where the base takes it up whatever it is; None where not."""
    constant = data.rows_of(np.ones((len(data.nodes), 1)))[:, :, 0]
    taken, *_ = np.linalg.lstsq(base[0], constant[0], rcond=1e-9)
    return constant if np.max(np.abs(base[0] @ taken - constant[0]), initial=0.0) < 1e-6 else None


def centred(option: Option, level: NDArray[np.float64] | None) -> Option:
    """Return an option without its constant part, where the base has that anyway.

    A supply of 5 V that wanders by millivolts would otherwise look like nothing but that constant.
    """
    if level is None:
        return option
    return replace(option, rows=option.rows - level[:, :, None] * option.rows[0].mean(axis=0))


def apart(option: Option, base: NDArray[np.float64]) -> Option:
    """Return a person's formula without what the base (R, m, k) has of it; other options as they are.

    Nobody writes a formula so that it is small at the middle of what was measured: of `supply_v * table_rate_dps` all
    but a hundredth is scale factor, and that hundredth is what was meant. What is the base's altogether stays.
    """
    if option.term is None or not option.term.formula or base.shape[2] == 0:
        return option
    taken, *_ = np.linalg.lstsq(base[0], option.rows[0], rcond=1e-9)
    rows = option.rows - base @ taken
    return replace(option, rows=rows) if np.linalg.norm(rows) > LEAST_APART * np.linalg.norm(option.rows) else option


def compare_models(
    data: ReducedRecording,
    model: ErrorModel,
    catalogue: Mapping[str, Effect] = CATALOGUE,
    designs: Mapping[str, Design] | None = None,
) -> Comparison:
    """Weigh every candidate against a model. `designs` may be those of an earlier call for the same model and data."""
    designs = designs or {axis: design_of(data, model, axis, catalogue) for axis in data.info.axes}
    axes, whites, scales = {}, {}, {}
    for axis, design in designs.items():
        axes[axis], whites[axis], scales[axis] = _weigh_axis(data, design, axis)
    return Comparison(data, model, designs, axes, whites, scales, _rank(designs, axes))


def with_noise_of(weighed: Comparison, fuller: Comparison) -> Comparison:
    """Return what was weighed, seen with the noise that is left beside a fuller model of the same data.

    Beside a model that misses an effect, that effect looks like drift. What speaks for each candidate stays as it was.
    """
    axes = {}
    for axis, design in weighed.designs.items():
        found, other = weighed.axes[axis], fuller.axes[axis]
        y = weighed.data.output[axis] - weighed.data.rows_of(weighed.data.nodes.rate_dps(axis)[:, None])[:, :, 0]
        (left,) = eliminate_base(design, y, fuller.white_var[axis], fuller.scales[axis], [other.best.noise])
        gain, dimensions = gains_of(left, found.slices)
        axes[axis] = replace(
            found, best=left, gain=gain, dimensions=dimensions, weights=other.weights, noises=other.noises
        )
    return replace(weighed, axes=axes, white_var=fuller.white_var, scales=fuller.scales)


def _weigh_axis(data: ReducedRecording, design: Design, axis: str) -> tuple[AxisEvidence, Array, NDArray[np.float64]]:
    y = data.output[axis] - data.rows_of(data.nodes.rate_dps(axis)[:, None])[:, :, 0]
    white, noises = _noise_of(data, design, y, axis)
    explained = np.zeros_like(y)
    for look in range(2):
        scale = _scales(design, y, white, explained)
        white_now = white + _growing(data, design, y, white, explained)
        weighed = evidence(design, y, white_now, scale, noises, int(design.present.sum()))
        leader = int(np.argmax(weighed.log_bf)) if len(weighed.log_bf) else -1
        if look == 1 or leader < 0 or weighed.log_bf[leader] < SECOND_LOOK:
            break
        explained = _explained(design, weighed, leader)
    return weighed, white_now, scale


def _explained(design: Design, weighed: AxisEvidence, option: int) -> NDArray[np.float64]:
    """Return what an option explains, (R, m)."""
    coefficients, _ = solve_option(weighed.best, weighed.slices[option])
    return np.asarray(design.options[option].rows @ coefficients)


def _noise_of(data: ReducedRecording, design: Design, y: NDArray[np.float64], axis: str) -> tuple[Array, list[Noise]]:
    stability = data.info.datasheet.get("bias_stability_dps")
    known = data.white_var
    white = known[axis] if known is not None else np.full(len(data), _floor_squared(design, y))
    level = float(np.sqrt(np.median(white)))
    return white, noise_grid(data.info.technology or "", stability, level, data.instability_dps(axis))


def _floor_squared(design: Design, y: NDArray[np.float64]) -> float:
    """Return the variance of a mean where no readings are known: from what a rich smooth model leaves."""
    rich = [design.base[0], *(o.rows[0] for o in design.options if o.smooth)]
    columns = np.concatenate(rich, axis=1)
    columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    u = u[:, s > 1e-6 * s[0]]
    left = y[0] - u @ (u.T @ y[0])
    return float((ROBUST * np.median(np.abs(left))) ** 2 * len(left) / max(len(left) - u.shape[1], 1))


def _base_residual(design: Design, y: NDArray[np.float64], white: Array) -> NDArray[np.float64]:
    """Return what the base leaves of y (R, m) when its means are fitted with equal drift: good enough for scatter."""
    weight = 1.0 / np.sqrt(white)
    columns = design.base[0] * weight[:, None]
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    solution, *_ = np.linalg.lstsq(columns / size, y[0] * weight, rcond=1e-9)
    return np.asarray(y - design.base @ (solution / size))


def _scales(
    design: Design, y: NDArray[np.float64], white: Array, explained: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the standard deviation of each coordinate (R, m): robust, one per kind, never below white noise."""
    residual = _base_residual(design, y - explained, white)
    scale = np.repeat(np.sqrt(white)[None, :], len(y), axis=0)
    for k in range(1, len(y)):
        here = design.present[k]
        if here.sum() < 8:
            continue
        values = residual[k, here] / scale[k, here]
        spread = ROBUST * float(np.median(np.abs(values - np.median(values))))
        scale[k] *= max(spread, 1.0)
    return scale


def _growing(
    data: ReducedRecording, design: Design, y: NDArray[np.float64], white: Array, explained: NDArray[np.float64]
) -> Array:
    """Return the variance of means that grows with the table's rate, (m,): scatter between sets of one rate."""
    rate = data.at_sets(data.nodes.table_rate_dps())
    residual = _base_residual(design, y - explained, white)[0]
    centred = residual.copy()
    position = np.asarray(data.nodes["position"]).reshape(len(data), -1)[:, 0]
    for there in np.unique(position):
        for value in np.unique(np.round(rate[position == there], 2)):
            same = (position == there) & (np.round(rate, 2) == value)
            centred[same] -= np.median(residual[same])
    speed = np.abs(rate)
    fast, slow = speed > np.quantile(speed, 2 / 3), speed < np.quantile(speed, 1 / 3)
    if fast.sum() < 12 or slow.sum() < 12:
        return np.zeros(len(rate))
    high, low = (ROBUST * float(np.median(np.abs(centred[part]))) for part in (fast, slow))
    if high < 1.5 * low:
        return np.zeros(len(rate))
    return np.asarray((high**2 - low**2) * (rate / float(np.median(speed[fast]))) ** 2)


def _rank(designs: Mapping[str, Design], axes: Mapping[str, AxisEvidence]) -> tuple[Candidate, ...]:
    names: dict[tuple[str, bool], None] = {}
    for design in designs.values():
        for option in design.options:
            names[option.candidate, option.smooth] = None
    found = [_candidate(name, smooth, designs, axes) for name, smooth in names]
    return tuple(sorted((c for c in found if c is not None), key=lambda c: -c.log_bf))


def _candidate(
    name: str, smooth: bool, designs: Mapping[str, Design], axes: Mapping[str, AxisEvidence]
) -> Candidate | None:
    per_axis: list[float] = []
    best: dict[str, int] = {}
    terms: dict[tuple[object, ...], tuple[Term | None, float]] = {}
    gain = 0.0
    for axis, design in designs.items():
        which = [i for i, o in enumerate(design.options) if (o.candidate, o.smooth) == (name, smooth)]
        values = axes[axis].log_bf[which] if which else np.zeros(0)
        if not len(values) or not np.any(np.isfinite(values)):
            continue
        per_axis.append(float(logsumexp(values) - np.log(np.isfinite(values).sum())))
        best[axis] = which[int(np.argmax(values))]
        gain += float(axes[axis].gain[best[axis]])
        for i, value in zip(which, values, strict=True):
            key = _key(design.options[i])
            terms[key] = (design.options[i].term, terms.get(key, (None, 0.0))[1] + float(value))
    if not per_axis:
        return None
    n = len(per_axis)
    joint = sum(per_axis)
    alternatives = [joint - np.log(2.0), *(value - np.log(2.0 * n) for value in per_axis)] if n > 1 else [joint]
    term = max(terms.values(), key=lambda pair: pair[1])[0]
    return Candidate(name, smooth, float(logsumexp(alternatives)), best, term, gain)


def _key(option: Option) -> tuple[object, ...]:
    term = option.term
    return () if term is None else (term.effect, term.order, *sorted(term.parameters.items()))
