"""Discrepancy of a named effect: possible errors of its shape, as columns of the base with a prior on their size.

No shape is exact. Beside an effect that was found, the base also holds its signal times smooth functions of what drives
it, smooth functions of these drivers, and what its parameters move, each with a Gaussian prior of a few per cent of the
signal (model discrepancy: Kennedy and O'Hagan 2001, doi:10.1111/1467-9868.00294). Where its shape is a choice, the
other choices may be as true. So the next candidates compete with the possible remainder of the effects that were named
before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.candidates import option_of
from labctl.fitting.criticism.channel_functions import hats, smooth_channels
from labctl.fitting.criticism.evidence.design import Discrepancy
from labctl.fitting.criticism.evidence.gains import solve_option
from labctl.fitting.criticism.model_comparison import Comparison
from labctl.fitting.criticism.ranking import Candidate
from labctl.fitting.criticism.search.refinement import CHOICES
from labctl.fitting.effects import CATALOGUE, Effect, Term
from labctl.fitting.numeric.arrays import Array

#: Standard deviation of the discrepancy over the signal: where it is multiplied, and over its peak where it is added.
SHAPE_ERROR = 0.05
#: Standard deviation of a parameter of the shape, in its logarithm, and the step by which its column is computed.
PARAMETER_ERROR, STEP = 0.2, 0.05
#: Knots of a smooth function of a driver; of the rate, which is given exactly, about one at each rate.
KNOTS, KNOTS_OF_RATE = 9, 21
#: Of what is no quantity to refine, the ends of a temperature range are no choice between shapes either.
EDGES = {"low_c", "high_c"}
#: Drivers of every effect.
DRIVERS = ("table_rate_dps", "temperature_c")


def discrepancies(comparison: Comparison, candidate: Candidate) -> dict[str, Discrepancy]:
    """Return axis -> the discrepancy of a candidate as it is fitted in a comparison."""
    by_axis = {}
    for axis, index in candidate.option.items():
        option = comparison.designs[axis].options[index]
        values, _ = solve_option(comparison.axes[axis].best, comparison.axes[axis].slices[index])
        signal = option.rows @ values
        if np.any(signal):
            by_axis[axis] = _of_signal(comparison, axis, option.term, signal, values)
    return by_axis


def _of_signal(
    comparison: Comparison, axis: str, term: Term | None, signal: NDArray[np.float64], values: Array
) -> Discrepancy:
    data = comparison.data
    kind = CATALOGUE.get(term.effect) if term is not None else None
    size_dps = float(np.max(np.abs(_beside_base(comparison, axis, signal[0]))))
    rows = []
    for name in drivers(kind, frozenset(smooth_channels(data, axis))):
        functions = hats(smooth_channels(data, axis)[name], KNOTS_OF_RATE if name == "table_rate_dps" else KNOTS)
        if functions is None:
            continue
        at_sets = np.column_stack([data.at_sets(column) for column in functions.T])
        rows += [SHAPE_ERROR * signal[:, :, None] * at_sets, SHAPE_ERROR * size_dps * data.rows_of(functions)]
    if kind is not None and term is not None:
        rows += _moved(comparison, axis, kind, term, values) + _otherwise_chosen(comparison, axis, term, signal)
    whole = np.concatenate(rows, axis=2) if rows else np.zeros((*signal.shape, 0))
    return Discrepancy(whole, np.ones(whole.shape[-1]))


def drivers(kind: Effect | None, channels: frozenset[str]) -> list[str]:
    """Return the channels on which an effect's shape may depend otherwise than its law says."""
    needs, draws = (kind.needs, kind.draws) if kind is not None else ((), ())
    names = dict.fromkeys((*DRIVERS, *needs, *draws))
    return [name for name in names if name in channels]


def _beside_base(comparison: Comparison, axis: str, means: Array) -> Array:
    """Return what the base leaves of a signal's means (m,)."""
    base = comparison.designs[axis].base[0]
    size = np.maximum(np.linalg.norm(base, axis=0), 1e-300)
    coordinates, *_ = np.linalg.lstsq(base / size, means, rcond=1e-9)
    return np.asarray(means - base / size @ coordinates)


def _moved(comparison: Comparison, axis: str, kind: Effect, term: Term, values: Array) -> list[NDArray[np.float64]]:
    """Return what each parameter of the shape moves, one column each."""
    moved_groups = []
    for name, at in term.parameters.items():
        if name in CHOICES or not at > 0:
            continue
        ends = []
        for factor in (np.exp(STEP), np.exp(-STEP)):
            moved = replace(term, parameters={**term.parameters, name: at * factor})
            option = option_of(comparison.data, axis, comparison.model.reference, kind, moved)
            if option is not None and option.rows.shape[2] == len(values):
                ends.append(option.rows @ values)
        if len(ends) == 2:
            moved_groups.append((PARAMETER_ERROR / (2 * STEP) * (ends[0] - ends[1]))[:, :, None])
    return moved_groups


def _otherwise_chosen(
    comparison: Comparison, axis: str, term: Term, signal: NDArray[np.float64]
) -> list[NDArray[np.float64]]:
    """Return an effect's signal in the best shape of each other choice, less its signal as chosen, one column each."""
    options, axis_comparison = comparison.designs[axis].options, comparison.axes[axis]
    best: dict[tuple[float, ...], int] = {}
    for i in np.argsort(axis_comparison.log_bf).tolist():
        other = options[i].term
        if other is not None and other.effect == term.effect and _choices(other) != _choices(term):
            best[_choices(other)] = i
    fitted = (
        (options[i].rows, solve_option(axis_comparison.best, axis_comparison.slices[i])[0]) for i in best.values()
    )
    return [(rows @ values - signal)[:, :, None] for rows, values in fitted]


def _choices(term: Term) -> tuple[float, ...]:
    return tuple(term.parameters.get(name, 0.0) for name in sorted(CHOICES - EDGES))


def together(parts: Sequence[Mapping[str, Discrepancy]]) -> dict[str, Discrepancy]:
    """Return the discrepancies of several findings side by side, by axis."""
    axes = dict.fromkeys(axis for part in parts for axis in part)
    return {
        axis: Discrepancy(
            np.concatenate([part[axis].rows for part in parts if axis in part], axis=2),
            np.concatenate([part[axis].precision for part in parts if axis in part]),
        )
        for axis in axes
    }
