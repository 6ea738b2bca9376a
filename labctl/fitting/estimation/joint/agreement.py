"""Agreement of recordings: each fitted alone with the model of all, and the coefficients compared effect by effect."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from labctl.errors import LabctlError
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.joined import recordings_in
from labctl.fitting.data.shifts import KINDS
from labctl.fitting.estimation.axis_solutions import solve_axes
from labctl.fitting.estimation.requirements import require_enough_data
from labctl.fitting.models.error_model import ErrorModel, is_exported
from labctl.fitting.models.fitted_model import AxisFit
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.least_squares import Solution
from labctl.json_types.joint import EffectAgreement

#: The effects that a shift between recordings adds to, by kind of shift.
SHIFTED = {kind.effect: kind for kind in KINDS.values()}
#: A direction whose variance is below this share of the largest is no direction of its own.
LEAST_VARIANCE = 1e-12
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


def agreement_of(
    data: FitData, model: ErrorModel, together: Mapping[str, Solution]
) -> tuple[list[EffectAgreement], str]:
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
    known = model.held.effects - {effect for one in fits.values() for fit in one.values() for effect in fit.effects}
    ours = [term.effect for term in model.terms if is_exported(term) and term.effect not in known]
    return [_agreement(effect, data.outputs, list(fits.values()), len(ours)) for effect in ours], ""


def _estimated(fit: AxisFit, held: tuple[str, ...]) -> AxisFit:
    """Return the coefficients of an axis without those that are held."""
    kept = [k for k, name in enumerate(fit.names) if name not in held]
    flat = np.repeat([name not in held for name in fit.names], fit.values.shape[1])
    return AxisFit(
        tuple(fit.effects[k] for k in kept),
        tuple(fit.names[k] for k in kept),
        tuple(fit.units[k] for k in kept),
        fit.values[kept],
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
    known = vectors[:, variances > LEAST_VARIANCE * max(float(variances.max()), 1e-300)]
    scaled = [(known.T @ v, known.T @ c @ known) for v, c in scaled]
    inverses = [np.linalg.pinv(covariance) for _, covariance in scaled]
    weight = sum(inverses)
    mean = np.linalg.solve(weight, sum(i @ v for i, (v, _) in zip(inverses, scaled, strict=True)))
    chi2 = sum(float((v - mean) @ i @ (v - mean)) for i, (v, _) in zip(inverses, scaled, strict=True))
    return _Scatter(chi2, known.shape[1] * (len(parts) - 1))


def _beside(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return an orthonormal basis (k, n) of what columns (k, s) do not span."""
    u, sizes, _ = np.linalg.svd(columns, full_matrices=True)
    return np.asarray(u[:, int(np.sum(sizes > 1e-9)) :])
