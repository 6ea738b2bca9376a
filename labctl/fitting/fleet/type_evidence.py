"""Which effects a type is missing: the evidence of all of its units together, where no single unit shows any.

Each shape of each effect may have a size that all units share, sizes that differ about 0 (the sign is each unit's own),
or both; a Bayes factor with unit-information priors weighs them against nothing. The likelihood is that of all
estimates of all units, with the sizes integrated out: what the sizes of a shape differ by adds to the scatter in the
directions of this shape alone, while noise that is larger than stated adds to it in all directions. Effects are
compared as in the criticism of one unit: over shapes and axes, then those that cannot be distinguished are one group.
What the leader and all of its shapes explain is taken off before the next effect is looked for.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from labctl.fitting.criticism import CandidateEstimates
from labctl.fitting.fleet.shape_evidence import (
    MIN_REMAINING,
    ShapeEvidence,
    common_evidence,
    common_size,
    evidence_of,
    noise_scale,
)
from labctl.fitting.fleet.type_sums import AxisSums, TypeSums
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.log_evidence import mean_evidence, on_all_axes_or_one
from labctl.texts import counted

#: Log evidence, nats, without which nothing is named; and that of a further effect beside one.
ENOUGH, ENOUGH_NEXT = 6.0, 9.0
#: A lead of less than this leaves both; beyond `FAR` the evidence alone decides against what is hardly distinguished.
LEAD, FAR = 3.0, 12.0
#: A rival that leaves less than this of the leader's chi2 is not distinguished, nor one of no more coefficients that
#: reproduces this share of it: no shape is known better than to about a fifth of its amplitude, and a fleet sees less.
INDISTINGUISHABLE_CHI2, ALIKE = 7.0, 0.95
#: A further effect takes off at least this share of the chi2 of the first one.
MIN_NEXT_SHARE = 0.1
#: Effects named at most, and units without which nothing is.
MAX_EFFECTS, MIN_UNITS = 4, 5
#: An effect is a bench's where the others show none of it, and it differs from theirs, at this level.
BENCH_LEVEL = 1e-3


@dataclass(frozen=True)
class UnitEvidence:
    """What the criticism of one unit says of every candidate (`candidate_estimates`)."""

    serial_number: str
    axes: Mapping[str, CandidateEstimates]
    bench: str | None = None


@dataclass(frozen=True)
class MeanSize:
    """A coefficient of an effect over the units of a type."""

    axis: str
    name: str
    unit: str
    mean: float
    u_mean: float  #: standard uncertainty of the mean
    spread: float  #: standard deviation of the units' sizes about the mean
    z: float  #: mean over its standard uncertainty
    u_of_unit: float  #: standard uncertainty with which one unit shows it, typically


@dataclass(frozen=True)
class BenchSize:
    """The first coefficient of an effect by the units of one bench."""

    bench: str
    units: int
    mean: float
    u_mean: float


@dataclass(frozen=True)
class TypeEffect:
    """One effect that the type is missing, or several that cannot be distinguished."""

    group: tuple[str, ...]  #: ids of the effects, the likeliest first
    shape: str  #: order and parameters of the likeliest shape in words
    log_bayes_factor: float  #: against nothing missing, nats
    sizes: tuple[MeanSize, ...]
    is_common: bool  #: whether units share the size; else its sign differs from unit to unit
    axes: tuple[str, ...]  #: output axes on which it shows
    rms_unit_z: float  #: root mean square of what the units show each, in standard uncertainties; 1 is noise alone
    benches: tuple[BenchSize, ...]
    of_bench: str | None  #: the only bench whose units show it: then it is the bench's error; None: no such bench


@dataclass(frozen=True)
class CandidateEvidence:
    """One effect over all units, named or not."""

    effect: str
    log_bayes_factor: float  #: against nothing missing, nats
    units: int  #: that can show it


@dataclass(frozen=True)
class TypeCriticism:
    """What a type is missing by the evidence of its units together."""

    units: int
    named: tuple[TypeEffect, ...]  #: strongest first
    candidates: tuple[CandidateEvidence, ...]  #: all effects, likeliest first, before any was taken off
    noise_ratio: float  #: by which estimates scatter more than their uncertainties say, at least 1; it is allowed for
    reason: str = ""  #: why nothing is said; "" where something is


@dataclass(frozen=True)
class _Candidate:
    """An effect over all axes."""

    effect: str
    log_bf: float
    best: Mapping[str, int]  #: axis -> number of its best shape
    gain: float


def sums_of(units: Iterable[UnitEvidence]) -> TypeSums:
    """Return the sums over units."""
    sums = TypeSums()
    for unit in units:
        sums.add(unit.axes, unit.bench)
    return sums


def type_evidence(units: Iterable[UnitEvidence]) -> TypeCriticism:
    """Return what a type is missing by its units."""
    return judged(sums_of(units))


def judged(sums: TypeSums) -> TypeCriticism:
    """Return what a type is missing by the sums over its units."""
    if sums.units < MIN_UNITS:
        return TypeCriticism(
            sums.units,
            (),
            (),
            1.0,
            f"{counted(sums.units, 'unit')} {'is' if sums.units == 1 else 'are'} too few; criticise at least "
            f"{MIN_UNITS} units of the type",
        )
    axes = sums.total()
    evidence = {axis: evidence_of(each) for axis, each in axes.items()}
    first = candidates = _candidates(axes, evidence)
    noise = {axis: float(noise_scale(each.whole, each.all_directions)) ** 0.5 for axis, each in axes.items()}
    named: list[TypeEffect] = []
    lead_gain = 0.0
    left = axes
    while candidates and len(named) < MAX_EFFECTS:
        leader = candidates[0]
        enough = ENOUGH if not named else ENOUGH_NEXT
        if leader.log_bf < enough or leader.gain < MIN_NEXT_SHARE * lead_gain:
            break
        if not named:
            noise |= {axis: float(evidence[axis].noise[shape]) for axis, shape in leader.best.items()}
        lead_gain = lead_gain or leader.gain
        named.append(_type_effect(sums, left, evidence, candidates, noise))
        left = {axis: _without(each, named[-1].group) for axis, each in left.items()}
        evidence = {axis: common_evidence(each, noise[axis]) for axis, each in left.items()}
        candidates = _candidates(left, evidence)
    return TypeCriticism(
        sums.units, tuple(named),
        tuple(CandidateEvidence(c.effect, c.log_bf, _units_of(axes, c)) for c in first),
        max(noise.values(), default=1.0),
    )  # fmt: skip


def _units_of(axes: Mapping[str, AxisSums], candidate: _Candidate) -> int:
    return int(max(axes[axis].units[shape] for axis, shape in candidate.best.items()))


def _candidates(axes: Mapping[str, AxisSums], evidence: Mapping[str, ShapeEvidence]) -> list[_Candidate]:
    """Return every effect over its shapes and axes, the likeliest first: on all of its axes, or on one of them."""
    effects = dict.fromkeys(shape.effect for sums in axes.values() for shape in sums.shapes)
    candidates = []
    for effect in effects:
        best, per_axis, gain = {}, [], 0.0
        for axis, sums in axes.items():
            places = [i for i, shape in enumerate(sums.shapes) if shape.effect == effect]
            values = evidence[axis].log_bf[places] if places else np.zeros(0)
            if not np.any(np.isfinite(values)):
                continue
            best[axis] = places[int(np.argmax(values))]
            per_axis.append(mean_evidence(values, int(np.isfinite(values).sum())))
            gain += float(evidence[axis].gain[best[axis]])
        if per_axis:
            candidates.append(_Candidate(effect, float(on_all_axes_or_one(per_axis)), best, gain))
    return sorted(candidates, key=lambda c: -c.log_bf)


def _type_effect(
    sums: TypeSums,
    axes: Mapping[str, AxisSums],
    evidence: Mapping[str, ShapeEvidence],
    candidates: Sequence[_Candidate],
    noise: Mapping[str, float],
) -> TypeEffect:
    """Return the leader with all that cannot be distinguished from it, and its sizes."""
    leader = candidates[0]
    group = (leader.effect, *(r.effect for r in candidates[1:] if _is_alike(axes, leader, r)))
    shown = tuple(a for a, i in leader.best.items() if evidence[a].log_bf[i] >= LEAD) or tuple(leader.best)
    strongest = max(shown, key=lambda a: evidence[a].log_bf[leader.best[a]])
    place = leader.best[strongest]
    sizes = tuple(size for axis in shown for size in _sizes(axes[axis], axis, leader.best[axis], noise[axis]))
    common = sum(float(evidence[a].common[leader.best[a]]) for a in shown)
    about = sum(float(evidence[a].about_zero[leader.best[a]]) for a in shown)
    n = axes[strongest].units[place] * max(axes[strongest].directions[place], 1.0)
    benches, of_bench = _by_bench(sums, strongest, axes[strongest].shapes[place].key, noise[strongest])
    return TypeEffect(
        group, axes[strongest].shapes[place].shape, leader.log_bf, sizes,
        bool(common >= about or max(abs(size.z) for size in sizes) > LEAD), shown,
        float(np.sqrt(axes[strongest].squares[place] / max(n, 1.0))), benches, of_bench,
    )  # fmt: skip


def _sizes(sums: AxisSums, axis: str, shape: int, ratio: float) -> list[MeanSize]:
    """Return mean and spread of the coefficients of a shape (DerSimonian and Laird 1986)."""
    own = sums.slice_of(shape)
    values, gain, directions = common_size(sums, shape)
    weight = np.maximum(np.diag(sums.information)[own], 1e-300)
    squared = sums.squared_weights[own]
    freedom = max(sums.units[shape] * max(sums.directions[shape], 1.0) - directions, 1.0)
    excess = max((sums.squares[shape] - gain) / ratio**2 / freedom - 1.0, 0.0)
    mean_weight = weight / max(sums.units[shape], 1.0)
    spread_var = excess * ratio**2 / mean_weight
    inverse = np.linalg.pinv(sums.information[own, own] / np.sqrt(np.outer(weight, weight)), rcond=MIN_REMAINING)
    variance = ratio**2 * np.diag(inverse) / weight + spread_var * squared / weight**2
    shaped = sums.shapes[shape]
    return [
        MeanSize(
            axis, name, unit_symbol, float(values[i]), float(np.sqrt(variance[i])), float(np.sqrt(spread_var[i])),
            float(values[i] / np.sqrt(variance[i])), float(ratio / np.sqrt(mean_weight[i])),
        )
        for i, (name, unit_symbol) in enumerate(zip(shaped.names, shaped.units, strict=True))
    ]  # fmt: skip


def _is_alike(axes: Mapping[str, AxisSums], leader: _Candidate, rival: _Candidate) -> bool:
    """Return whether the data cannot tell a rival from the leader."""
    if rival.log_bf > leader.log_bf - LEAD:
        return True
    if rival.log_bf <= 0:
        return False
    part = whole = 0.0
    for axis, shape in leader.best.items():
        values, gain, _ = common_size(axes[axis], shape)
        whole += gain
        if axis in rival.best:
            part += _reproduced(axes[axis], shape, values, rival.best[axis])
    share = part / whole if whole > 0 else 0.0
    exact = all(axes[axis].shapes[shape].is_exact for each in (leader, rival) for axis, shape in each.best.items())
    if share > ALIKE and not exact and _directions(axes, rival) <= _directions(axes, leader):
        return True
    return rival.log_bf > leader.log_bf - FAR and (1.0 - share) * whole < INDISTINGUISHABLE_CHI2


def _directions(axes: Mapping[str, AxisSums], candidate: _Candidate) -> float:
    return float(sum(axes[axis].directions[shape] for axis, shape in candidate.best.items()))


def _reproduced(sums: AxisSums, shape: int, values: Array, by: int) -> float:
    """Return the part of a shape's common signal that another shape reproduces, in chi2."""
    own, other = sums.slice_of(shape), sums.slice_of(by)
    inner = sums.information[other, own] @ values
    block = sums.information[other, other]
    size = np.sqrt(np.maximum(np.diag(block), 1e-300))
    values_of, vectors = np.linalg.eigh(block / np.outer(size, size))
    kept = values_of > MIN_REMAINING
    return float(np.sum((vectors[:, kept].T @ (inner / size)) ** 2 / values_of[kept]))


def _without(sums: AxisSums, effects: Sequence[str]) -> AxisSums:
    """Return sums beside all shapes of some effects with common sizes; only what a common size takes off is left."""
    own = [i for i, shape in enumerate(sums.shapes) if shape.effect in effects]
    if not own:
        return sums
    columns = np.concatenate([np.arange(s.start, s.stop) for s in map(sums.slice_of, own)])
    size = np.sqrt(np.maximum(np.diag(sums.information), 1e-300))
    scaled, product = sums.information / np.outer(size, size), sums.products / size
    values, vectors = np.linalg.eigh(scaled[np.ix_(columns, columns)])
    kept = values > MIN_REMAINING
    basis = scaled[:, columns] @ (vectors[:, kept] / np.sqrt(values[kept]))
    explained = (vectors[:, kept].T @ product[columns]) / np.sqrt(values[kept])
    left = scaled - basis @ basis.T
    gone = np.diag(left) < MIN_REMAINING
    left[gone] = left[:, gone] = 0.0
    rest = np.where(gone, 0.0, product - basis @ explained)
    keep = [i for i in range(len(sums.shapes)) if i not in own and not np.all(gone[sums.slice_of(i)])]
    return _taken(sums, keep, left * np.outer(size, size), rest * size)


def _taken(sums: AxisSums, keep: Sequence[int], information: NDArray[np.float64], products: Array) -> AxisSums:
    """Return some shapes of sums, with other inner products."""
    at = np.concatenate([np.zeros(0, dtype=np.int64), *(
        np.arange(s.start, s.stop) for s in map(sums.slice_of, keep)
    )])  # fmt: skip
    shapes = [sums.shapes[i] for i in keep]
    starts = np.cumsum([0, *(len(shape.names) for shape in shapes)])[:-1].tolist()
    return AxisSums(
        shapes, {shape.key: i for i, shape in enumerate(shapes)}, starts, sums.units[list(keep)],
        sums.squares[list(keep)], sums.directions[list(keep)], information[np.ix_(at, at)], products[at],
        sums.squared_weights[at], sums.whole, sums.all_directions,
    )  # fmt: skip


def _by_bench(
    sums: TypeSums, axis: str, key: tuple[str, str, tuple[str, ...]], ratio: float
) -> tuple[tuple[BenchSize, ...], str | None]:
    """Return the first coefficient of a shape by bench, and the only bench whose units show it."""
    effects = []
    for bench, axes in sums.benches.items():
        if not bench or axis not in axes or key not in axes[axis].places:
            continue
        shape = axes[axis].places[key]
        size = _sizes(axes[axis], axis, shape, ratio)[0]
        effects.append(BenchSize(bench, int(axes[axis].units[shape]), size.mean, size.u_mean))
    showing = [each for each in effects if abs(each.mean) > LEAD * each.u_mean]
    if len(effects) < 2 or len(showing) != 1:
        return tuple(effects), None
    weight = np.array([each.u_mean**-2.0 for each in effects])
    means = np.array([each.mean for each in effects])
    chi2 = float(weight @ (means - np.average(means, weights=weight)) ** 2)
    differs = float(chdtrc(len(effects) - 1, chi2)) < BENCH_LEVEL
    return tuple(effects), showing[0].bench if differs else None
