"""Findings of a fit to several recordings: repeatability, agreement, and each recording predicted by the others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from labctl.answers.joint import EffectAgreement, HeldOutRecording, JointJson, RepeatabilityJson, ShiftJson
from labctl.errors import LabctlError, NotEnoughData
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.joined import recordings_in
from labctl.fitting.data.shifts import KINDS, ShiftKind, shifts_of
from labctl.fitting.estimation.axis_solutions import AxisSolutions, fit_turning, residuals, solve_axes
from labctl.fitting.estimation.error_metrics import rms
from labctl.fitting.estimation.requirements import require_enough_data
from labctl.fitting.models.error_model import ErrorModel, is_exported
from labctl.fitting.models.fitted_model import AxisFit, FittedModel
from labctl.fitting.models.inversion import NotConverged
from labctl.fitting.models.presets import Preset
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.drift_noise import Noise
from labctl.shown_unit import shown_unit

#: The effects that a shift between recordings adds to, by kind of shift.
SHIFTED = {kind.effect: kind for kind in KINDS.values()}
#: A direction whose variance is below this share of the largest is no direction of its own.
MIN_VARIANCE = 1e-12
#: Probability of so different coefficients from noise alone below which recordings disagree, over all effects.
DISAGREE = 0.01


@dataclass(frozen=True)
class _Scatter:
    """Chi2 of separate coefficients about their weighted mean, and its degrees of freedom."""

    chi2: float = 0.0
    freedom: int = 0

    def __add__(self, other: _Scatter) -> _Scatter:
        return _Scatter(self.chi2 + other.chi2, self.freedom + other.freedom)

    @property
    def p_value(self) -> float | None:
        """The probability of a larger one from noise alone; None without a degree of freedom."""
        return float(chdtrc(self.freedom, self.chi2)) if self.freedom else None


def of_each_recording(data: FitData) -> dict[int, FitData]:
    """Return number -> the data sets of each recording of several, in order of time."""
    of = np.asarray(data.channels["recording"])
    return {number: data.take(of == number) for number in recordings_in(data.channels.columns)}


def agreement_of(data: FitData, model: ErrorModel, together: Mapping[str, Noise]) -> tuple[list[EffectAgreement], str]:
    """Return how well recordings agree on each effect of the unit's model, and why not where they cannot be compared.

    Each is weighted by the noise of the fit to all of them, `together`: a fit to one alone may underestimate its drift.
    The chi2 of an effect that is shifted from recording to recording is given with and without what a shift explains.
    """
    fits: dict[int, Mapping[str, AxisFit]] = {}
    model = replace(model, held=model.held.as_exact())  # an error of what all hold alike sets none of them apart
    for number, alone in of_each_recording(data).items():
        try:
            require_enough_data(alone, model)
            solved = solve_axes(alone, model, together).fits
            fits[number] = {axis: _estimated(fit, tuple(model.held.axes.get(axis, ()))) for axis, fit in solved.items()}
        except LabctlError as error:
            return [], f"recording {number} alone does not determine the model: {error}"
    held_only = model.held.effects - {effect for one in fits.values() for fit in one.values() for effect in fit.effects}
    ours = [term.effect for term in model.terms if is_exported(term) and term.effect not in held_only]
    return [_agreement(effect, data.outputs, list(fits.values()), len(ours)) for effect in ours], ""


def _estimated(fit: AxisFit, held: tuple[str, ...]) -> AxisFit:
    """Return the coefficients of an axis without those that are held."""
    estimated = [k for k, name in enumerate(fit.names) if name not in held]
    flat = np.repeat([name not in held for name in fit.names], fit.values.shape[1])
    return AxisFit(
        tuple(fit.effects[k] for k in estimated),
        tuple(fit.names[k] for k in estimated),
        tuple(fit.units[k] for k in estimated),
        fit.values[estimated],
        fit.covariance[np.ix_(flat, flat)],
    )


def _agreement(
    effect: str, axes: Mapping[str, Array], fits: list[Mapping[str, AxisFit]], effects: int
) -> EffectAgreement:
    every, beside = _Scatter(), _Scatter()
    for axis in axes:
        names = [
            tuple(n for n, owner in zip(fit[axis].names, fit[axis].effects, strict=True) if owner == effect)
            for fit in fits
        ]
        if not names[0] or any(other != names[0] for other in names):
            continue
        parts = [_of_effect(fit[axis], effect) for fit in fits]
        every += _scatter(parts, None)
        shift = _shift_columns(len(names[0]), parts[0][0], effect)
        beside += _scatter(parts, shift)
    p = beside.p_value if effect in SHIFTED else every.p_value
    return {
        "effect": effect,
        "chi2": every.chi2, "freedom": every.freedom, "p_value": every.p_value,
        "chi2_beside_shifts": beside.chi2 if effect in SHIFTED else None,
        "freedom_beside_shifts": beside.freedom if effect in SHIFTED else None,
        "p_value_beside_shifts": beside.p_value if effect in SHIFTED else None,
        "shift": SHIFTED[effect].term if effect in SHIFTED else None,
        "agree": p is None or p >= DISAGREE / max(effects, 1),
    }  # fmt: skip


def _of_effect(fit: AxisFit, effect: str) -> tuple[Array, NDArray[np.float64]]:
    """Return the coefficients of one effect, flat, with their covariance."""
    rows = [k for k, owner in enumerate(fit.effects) if owner == effect]
    m = fit.values.shape[1]
    flat = np.concatenate([np.arange(k * m, (k + 1) * m) for k in rows])
    return fit.values[rows].ravel(), fit.covariance[np.ix_(flat, flat)]


def _shift_columns(names: int, values: Array, effect: str) -> NDArray[np.float64] | None:
    """Return what a shift adds to the flat coefficients of an effect, (k, names): the same at every temperature."""
    if effect not in SHIFTED:
        return None
    return np.asarray(np.kron(np.eye(names), np.ones((len(values) // names, 1))), dtype=np.float64)


def _scatter(parts: list[tuple[Array, NDArray[np.float64]]], shift: NDArray[np.float64] | None) -> _Scatter:
    """Return the scatter of coefficients (k,) with covariances (k, k), where shifts (k, s) are free in each."""
    if any(not np.all(np.isfinite(covariance)) for _, covariance in parts):
        return _Scatter()
    size = np.sqrt(np.maximum(np.diag(sum(covariance for _, covariance in parts)), 1e-300))
    keep = np.eye(len(size)) if shift is None else _beside(shift / size[:, None])
    scaled = [(keep.T @ (v / size), keep.T @ (c / np.outer(size, size)) @ keep) for v, c in parts]
    if keep.shape[1] == 0:
        return _Scatter()
    variances, vectors = np.linalg.eigh(sum(covariance for _, covariance in scaled))
    seen_vectors = vectors[:, variances > MIN_VARIANCE * max(float(variances.max()), 1e-300)]
    scaled = [(seen_vectors.T @ v, seen_vectors.T @ c @ seen_vectors) for v, c in scaled]
    inverses = [np.linalg.pinv(covariance) for _, covariance in scaled]
    weight = sum(inverses)
    mean = np.linalg.solve(weight, sum(i @ v for i, (v, _) in zip(inverses, scaled, strict=True)))
    chi2 = sum(float((v - mean) @ i @ (v - mean)) for i, (v, _) in zip(inverses, scaled, strict=True))
    return _Scatter(chi2, seen_vectors.shape[1] * (len(parts) - 1))


def _beside(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return an orthonormal basis (k, n) of what columns (k, s) do not span."""
    u, sizes, _ = np.linalg.svd(columns, full_matrices=True)
    return np.asarray(u[:, int(np.sum(sizes > 1e-9)) :])


#: Probability of such shifts from noise alone below which they are said to be there.
SEEN = 0.01
#: A smaller probability is said to be smaller than this.
SMALLEST = 1e-12


def joint_findings(data: FitData, model: ErrorModel, preset: Preset, solutions: AxisSolutions) -> JointJson | None:
    """Return what several recordings say together; None for a single one. `solutions` is the fit to all of them."""
    recordings = recordings_in(data.channels.columns)
    if len(recordings) < 2:
        return None
    repeatability = {axis: _repeatability(data, axis, solutions) for axis in data.outputs}
    agreement, not_compared = agreement_of(data, model, solutions.noise)
    held_out, pooled = _held_out(data, preset)
    return {
        "recordings": recordings,
        "repeatability": repeatability,
        "agreement": agreement,
        "not_compared": not_compared,
        "held_out": held_out,
        "heldout_rms_dps": rms(pooled),
        "text": [*_of_shifts(repeatability), *_of_agreement(agreement, not_compared, recordings)],
    }


def _repeatability(data: FitData, axis: str, solutions: AxisSolutions) -> list[RepeatabilityJson]:
    """Return the spread of each kind of shift of one axis, with the shifts themselves."""
    shifts, solution = shifts_of(data.channels, axis), solutions.solutions[axis]
    begin = len(solution.values) - len(shifts)
    u = np.sqrt(np.maximum(np.diag(solution.covariance)[begin:], 0.0))
    lines: list[RepeatabilityJson] = []
    present: set[ShiftKind] = {shift.kind for shift in shifts}
    for kind, component in zip(sorted(present), solution.components, strict=True):
        shift_rows: list[ShiftJson] = [
            {
                "recording": shift.recording, "number": shift.number, "along": shift.along,
                "value": float(solution.values[begin + k]), "u": float(u[k]),
            }
            for k, shift in enumerate(shifts)
            if shift.kind == kind
        ]  # fmt: skip
        lines.append(
            {
                "kind": kind, "term": KINDS[kind].term, "unit": KINDS[kind].unit,
                "value": component.value, "u": component.u, "low": component.low, "high": component.high,
                "freedom": component.groups, "p_value": component.p_value, "seen": component.p_value < SEEN,
                "shifts": shift_rows,
            }
        )  # fmt: skip
    return sorted(lines, key=lambda line: list(KINDS).index(line["kind"]))


def _held_out(data: FitData, preset: Preset) -> tuple[list[HeldOutRecording], dict[str, Array]]:
    """Return the error on each recording of a fit to the others, and all these errors by axis.

    The recording's own shifts are not known in advance, so they are part of the error; the direction of north is.
    """
    of, lines = np.asarray(data.channels["recording"]), []
    pooled: dict[str, list[Array]] = {axis: [] for axis in data.outputs}
    for number, left_out in of_each_recording(data).items():
        data_used = data.take(of != number)
        try:
            model, rows = preset.build(data_used)
            require_enough_data(data_used.take(rows), model)
            fitted = FittedModel(model, solve_axes(data_used.take(rows), model).fits)
            errors = residuals(fitted, left_out, fit_turning(fitted, left_out))
        except (NotEnoughData, NotConverged) as error:
            lines.append(HeldOutRecording(recording=number, rms_dps=None, why=str(error)))
            continue
        lines.append(HeldOutRecording(recording=number, rms_dps=rms(errors), why=""))
        for axis, values in errors.items():
            pooled[axis].append(values)
    return lines, {axis: np.concatenate(parts) for axis, parts in pooled.items() if parts}


def _of_shifts(repeatability: Mapping[str, list[RepeatabilityJson]]) -> Iterator[str]:
    for axis, lines in repeatability.items():
        for line in lines:
            if not line["freedom"]:
                continue
            shown = shown_unit(line["unit"], line["term"])
            if not line["seen"]:
                most = f"{shown.number(line['high'])} {shown.unit}"
                yield f"Axis {axis}: no {line['term']}, beyond the noise; at most {most}."
                continue
            values = [shift["value"] for shift in line["shifts"]]
            widest = shown.number(max(values) - min(values))
            size = (
                f"{shown.number(line['value'])} {shown.unit} (95 %: {shown.number(line['low'])} to "
                f"{shown.number(line['high'])})"
            )
            yield (
                f"Axis {axis}: shifts of up to {widest} {shown.unit} between the recordings "
                f"({_probability(line['p_value'])}) are {line['term']}: standard deviation {size}. These shifts are "
                "neither a drift nor part of the calibration."
            )


def _probability(p_value: float | None) -> str:
    """Return "p = 0.003", or "p < 1e-12" for one so small that its figures mean nothing."""
    return f"p = {p_value:.2g}" if p_value is not None and p_value > SMALLEST else f"p < {SMALLEST:g}"


def _of_agreement(agreement: list[EffectAgreement], not_compared: str, recordings: list[int]) -> Iterator[str]:
    if not_compared:
        yield f"The recordings could not be compared effect by effect: {not_compared}."
        return
    numbers = ", ".join(map(str, recordings))
    apart = [each for each in agreement if not each["agree"]]
    for each in apart:
        beside = each["chi2_beside_shifts"] is not None
        chi2 = each["chi2_beside_shifts"] if beside else each["chi2"]
        freedom = each["freedom_beside_shifts"] if beside else each["freedom"]
        p_value = each["p_value_beside_shifts"] if beside else each["p_value"]
        more = " beside the shift between them" if beside else ""
        yield (
            f"Recordings {numbers} disagree on {each['effect']}{more}: chi2 {chi2:.3g} for {freedom} degrees of "
            f"freedom, {_probability(p_value)}; a single value for all recordings is an average of different values."
        )
    if agreement and not apart:
        yield f"Recordings {numbers} agree on every effect of the model beside the shifts between them."
