"""How many heat flows a recording shows: the time constants of a lag, and its structure by legs left out.

A structure with more time constants always leaves less of the data that it is fitted to; it is only taken where it
predicts stretches of the temperature course that it has not seen clearly better than a simpler one. Axes whose
structures differ have one each where that predicts clearly better than one structure for all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.temperature.legs import legs_of
from labctl.fitting.effects import Term, kind_of
from labctl.fitting.effects.thermal_lag import Lag
from labctl.fitting.estimation.thermal_flows import (
    APART,
    GRID_S,
    MAX_STEPS,
    NONE,
    STRUCTURES,
    Axis,
    Errors,
    LeftOut,
    Stretch,
    Structure,
    Taus,
    best_taus,
    errors_of,
    moved_around,
    pooled,
)
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.numeric.blas_threads import single_threaded

#: Time constants of warming and cooling differ by more than so many standard uncertainties of their ratio, where the
#: data tell both.
TOLD_APART, MAX_CONDITION = 3.0, 1e12
#: Chi2 by which a structure of one axis leaves less of all data for each coefficient more, over the noise.
SEEN = 16.0
#: Data sets that a stretch needs, legs up to which each is left out, and how far beyond the others it is tested, K.
MIN_SETS, MAX_LEGS, BEYOND_K = 4, 12, 1.0
#: What stands for structures that differ from axis to axis.
BY_AXIS = "by_axis"


@dataclass(frozen=True)
class ThermalResponse:
    """The structure that a recording shows, in its best shape, and what each structure left of stretches unseen."""

    term: Term
    structure: Structure
    held_out: Mapping[str, LeftOut]  #: by structure, "none" among them; empty where no stretch could be left out


@single_threaded
def thermal_response(data: FitData, model: ErrorModel, term: Term) -> ThermalResponse | None:
    """Return the lag of bias or scale factor beside the other effects of a model; `term` is what it replaces.

    None where the temperature goes one way only, so that no part of its course says what another does.
    """
    stretches = stretches_of(data)
    kind = kind_of(term)
    if not stretches or not isinstance(kind, Lag) or data.channels.missing(kind.channels):
        return None
    model_left = model.with_terms(tuple(t for t in model.terms if t.effect != term.effect))
    axes = [Axis(data, model_left, axis, kind) for axis in data.outputs]
    tried = [structure for structure in STRUCTURES if structure.id != "per_axis" or len(axes) > 1]
    errors = {structure.id: errors_of(axes, structure, stretches) for structure in (NONE, *tried)}
    held_out = {name: pooled(axis_errors) for name, axis_errors in errors.items()}
    every = np.ones(len(data), dtype=bool)
    chosen, axis_errors = _told_apart(axes, tried, held_out, every)
    structures = dict.fromkeys((axis.name for axis in axes), chosen)
    if len(axes) > 1:
        by_axis = [_of_axis(axis, errors, stretches, every) for axis in axes]
        held_out[BY_AXIS] = pooled([each for part in by_axis for each in part.errors])
        if len({part.structure.id for part in by_axis}) > 1 and held_out[BY_AXIS].is_below(held_out[chosen.id]):
            structures = {part.name: part.structure for part in by_axis}
            axis_errors = {part.name: part.taus_s for part in by_axis}
            chosen = _by_axis(structures)
    return ThermalResponse(_term_of(axes, term, structures, axis_errors), chosen, held_out)


@dataclass(frozen=True)
class _OfAxis:
    """What one axis shows by itself."""

    name: str
    structure: Structure
    taus_s: Mapping[str, float]
    errors: Errors


def _of_axis(
    axis: Axis, errors: Mapping[str, Errors], stretches: Sequence[Stretch], all_rows: NDArray[np.bool_]
) -> _OfAxis:
    """Return the structure of one axis by what was left out of it; of what each axis has by itself that is known."""
    tried, by_structure = [], {}
    for structure in STRUCTURES:
        if structure is STRUCTURES[0]:  # on one axis the same as a time constant on each
            continue
        of_axis = structure.of_axis()
        axis_errors = [each for each in errors.get(structure.id, ()) if each[0] is axis]
        tried.append(of_axis)
        by_structure[of_axis.id] = axis_errors if structure.per_axis else errors_of([axis], of_axis, stretches)
    held_out = {name: pooled(axis_terms) for name, axis_terms in by_structure.items()}
    while True:
        structure, structure_errors = _told_apart([axis], tried, held_out, all_rows)
        taus_s = structure_errors[axis.name]
        if structure is tried[0] or _is_seen(axis, structure, taus_s, tried[0], all_rows):
            return _OfAxis(axis.name, structure, taus_s, by_structure[structure.id])
        tried.remove(structure)


def _is_seen(
    axis: Axis, structure: Structure, taus_s: Mapping[str, float], simplest: Structure, all_rows: NDArray[np.bool_]
) -> bool:
    """Return whether a structure also leaves clearly less of all data of one axis than the simplest.

    Few stretches are left out of one axis, and the errors within one are those of one extrapolation: chance.
    """
    simple_s = best_taus([axis], simplest, all_rows, MAX_STEPS)[axis.name]
    full_chi2, simple = (
        float(np.sum(axis.left_over_noise(axis.columns(each, taus), all_rows) ** 2))
        for each, taus in ((structure, taus_s), (simplest, simple_s))
    )
    more = structure.coefficients(1) - simplest.coefficients(1)
    return simple - full_chi2 > SEEN * max(more, 1) * max(full_chi2 / len(all_rows), 1.0)


def _by_axis(structures: Mapping[str, Structure]) -> Structure:
    """Return what stands for structures that differ from axis to axis, in words and in what was not looked for."""
    sentence = "; ".join(f"on {axis} {structure.sentence}" for axis, structure in structures.items())
    fixed = {f"{name}_{axis}": tau_s for axis, each in structures.items() for name, tau_s in each.fixed.items()}
    return Structure(BY_AXIS, sentence, fixed=fixed)


def _told_apart(
    axes: Sequence[Axis], structures: Sequence[Structure], held_out: Mapping[str, LeftOut], all_rows: NDArray[np.bool_]
) -> tuple[Structure, Taus]:
    """Return the structure chosen, and its time constants, among those whose time constants are not the same."""
    tried = list(structures)
    while True:
        chosen = _chosen(tried, held_out)
        taus = best_taus(axes, chosen, all_rows, MAX_STEPS)
        if are_told_apart(axes, chosen, taus, all_rows):
            return chosen, taus
        tried.remove(chosen)


def _chosen(tried: Sequence[Structure], held_out: Mapping[str, LeftOut]) -> Structure:
    """Return the simplest structure that no larger one clearly betters on what was left out."""
    chosen = tried[0]
    for size in sorted({structure.size for structure in tried}):
        best = min((s for s in tried if s.size == size), key=lambda s: held_out[s.id].chi2)
        chosen = best if held_out[best.id].is_below(held_out[chosen.id]) else chosen
    return chosen


def are_told_apart(axes: Sequence[Axis], structure: Structure, taus: Taus, in_fit: NDArray[np.bool_]) -> bool:
    """Return whether the two time constants of a structure are not one and the same.

    Those of two flows on each axis: nearer ones are one flow. Those of warming and cooling on one axis at least, beyond
    `TOLD_APART` standard uncertainties of their ratio.
    """
    if structure.two_ways:
        return any(_ways_differ(axis, structure, taus[axis.name], in_fit) for axis in axes)
    least = GRID_S[APART] / GRID_S[0]
    both = [(taus_s["tau"], taus_s["second_tau"]) for taus_s in taus.values() if "second_tau" in taus_s]
    return all(max(pair) >= least * min(pair) for pair in both)


def _ways_differ(axis: Axis, structure: Structure, taus_s: Mapping[str, float], in_fit: NDArray[np.bool_]) -> bool:
    """Return whether warming and cooling have different time constants, by the curvature of what is left."""
    logarithms = np.log([taus_s[name] for name in structure.constants])
    (part,) = moved_around([axis], structure, in_fit, logarithms)
    freedom = max(len(part.residual) - axis.base.shape[1] - len(structure.columns) - len(logarithms), 1)
    information = part.slopes.T @ part.slopes / (part.chi2 / freedom)
    if np.linalg.cond(information) > MAX_CONDITION:
        return False
    apart = np.array([1.0 if name == "tau" else -1.0 for name in structure.constants])
    u = float(np.sqrt(apart @ np.linalg.solve(information, apart)))
    return abs(float(apart @ logarithms)) > TOLD_APART * u


def stretches_of(data: FitData) -> list[tuple[NDArray[np.bool_], NDArray[np.bool_]]]:
    """Return what is left out in turn, as masks (m,) of the data sets that are fitted and of those that are tested.

    With three legs or more each of them; half of it at a time where the others would go one way only, on which a lag
    looks like another law of temperature. Of two legs, each half of each. What lies at temperatures that the others did
    not reach is not tested.
    """
    if not data.channels.history.thermometer or "t_s" not in data.channels:
        return []
    run = np.asarray(data.channels["run"], dtype=np.int64) if "run" in data.channels else np.ones(len(data), dtype=int)
    legs = legs_of(data.temperature_c, run)
    numbers = [int(number) for number in np.unique(legs) if number]
    if len(numbers) < 2 or len(numbers) > MAX_LEGS:
        return []
    whole = [legs == number for number in numbers]
    parts = []
    for part in whole:
        others = {_rises(data, other) for other in whole if other is not part}
        pieces = np.array_split(np.flatnonzero(part), 1 if len(others) == 2 else 2)
        parts += [np.isin(np.arange(len(data)), piece) for piece in pieces]
    stretches = []
    for part in parts:
        in_fit, temperature_c = ~part, data.temperature_c
        low, high = float(temperature_c[in_fit].min()) - BEYOND_K, float(temperature_c[in_fit].max()) + BEYOND_K
        tested = part & (temperature_c >= low) & (temperature_c <= high)
        if tested.sum() >= MIN_SETS:
            stretches.append((in_fit, tested))
    return stretches if len(stretches) > 1 else []


def _rises(data: FitData, leg: NDArray[np.bool_]) -> bool:
    """Return whether the temperature is higher in the second half of a leg than in the first."""
    first, second = np.array_split(data.temperature_c[leg], 2)
    return bool(np.mean(second) > np.mean(first))


def _term_of(axes: Sequence[Axis], term: Term, structures: Mapping[str, Structure], taus: Taus) -> Term:
    """Return the term with the time constants of the axes' structures, those of each axis or of all."""
    named = {name: value for name, value in term.parameters.items() if not name.endswith("_s")}
    parameters = {name: value for name, value in named.items() if not name.startswith("curved")}
    curved = [axis for axis, each in structures.items() if any(part == "curved" for _, part in each.columns)]
    parameters |= {"curved": 1.0} if len(curved) == len(axes) else {f"curved_{axis}": 1.0 for axis in curved}
    apart = any(structure.per_axis for structure in structures.values()) and len(axes) > 1
    for axis in axes if apart else axes[:1]:
        of_axis = f"_{axis.name}" if apart else ""
        parameters |= {f"{name}{of_axis}_s": value for name, value in taus[axis.name].items()}
    return replace(term, parameters=parameters)


def lags_of(model: ErrorModel) -> list[Term]:
    """Return the lags of a model, of the bias and of the scale factor."""
    return [term for term in model.terms if isinstance(kind_of(term), Lag)]
