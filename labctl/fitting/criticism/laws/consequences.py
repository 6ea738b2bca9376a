"""What else would follow from a law: its symmetry, and its values beyond what was measured, in sentences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from labctl.fitting.criticism.criticism import Criticism
from labctl.fitting.criticism.laws.proposals import Law
from labctl.fitting.criticism.laws.shapes import TEMPERATURE
from labctl.fitting.data.channels import Channels
from labctl.fitting.effects.formula import RATES, Formula
from labctl.fitting.numeric.arrays import Array

#: A law is even or odd in the rate where less than this share of it is not.
SYMMETRIC = 0.02
#: Beyond the fastest rate by this share, and beyond the temperatures by so much, K.
FASTER, BEYOND_K = 0.25, 10.0


def consequences(law: Law, found: Criticism) -> list[str]:
    """Return what else would follow from a law, one sentence each, on the axis on which it is largest."""
    data = found.fit_data
    values = {axis: _of(law, data.channels, axis) for axis in data.outputs}
    axis = max(values, key=lambda name: float(np.ptp(values[name])))
    said = [_symmetry(law, data.channels, axis)] if _has_rate(law) else ["It does not depend on the rate."]
    rates = np.abs(data.true_rate_dps(axis))
    fastest = float(rates.max())
    if _has_rate(law) and (1 + FASTER) * fastest <= (data.info.max_rate_dps or np.inf):
        row = int(np.argmax(rates))
        faster = _at_rates(data.channels, axis, 1 + FASTER)
        said.append(
            f"At {(1 + FASTER) * fastest:.4g} deg/s, which was not measured, it would be "
            f"{_of(law, faster, axis)[row]:.3g} deg/s (at {fastest:.4g} deg/s it is {values[axis][row]:.3g})."
        )
    if any(TEMPERATURE in text for text in law.formulas):
        said += [_beyond(law, data.channels, axis, sign, data.temperature_c, values[axis]) for sign in (1, -1)]
    return said


def _of(law: Law, channels: Channels, axis: str) -> Array:
    """Return the values of a law alone, (n,) deg/s, by the coefficients of its fit."""
    model, of_axis = law.fit.fitted.model, law.fit.fitted.axes[axis]
    total = np.zeros(len(channels))
    for term in law.terms:
        (column,) = Formula(term.effect, term.formula).columns(channels, axis, term, model.reference)
        for row, owner in enumerate(of_axis.effects):
            if owner == term.effect:
                total = total + column.values * float(of_axis.values[row, 0])
    return total


def _has_rate(law: Law) -> bool:
    return any(name in text for text in law.formulas for name in RATES)


def _at_rates(channels: Channels, axis: str, share: float) -> Channels:
    return channels.with_rates({**channels.rates, axis: share * channels.rate_dps(axis)})


def _symmetry(law: Law, channels: Channels, axis: str) -> str:
    there, back = (_of(law, _at_rates(channels, axis, share), axis) for share in (1.0, -1.0))
    at_rest = _of(law, _at_rates(channels, axis, 0.0), axis)
    size = max(float(np.abs(there).max()), 1e-300)
    rest = float(np.abs(at_rest).max())
    if float(np.abs(there + back).max()) < SYMMETRIC * size:
        return "It changes its sign with the direction of the rate, and is 0 at rest."
    if float(np.abs(there - back).max()) < SYMMETRIC * size:
        there_at_rest = f"up to {rest:.3g} deg/s" if rest > SYMMETRIC * size else "0"
        return f"It is the same in both directions of the rate; at rest it is {there_at_rest}."
    return "It differs between the directions of the rate by more than its sign."


def _beyond(law: Law, channels: Channels, axis: str, sign: int, temperature_c: Array, values: Array) -> str:
    row = int(np.argmax(sign * temperature_c))
    end_c = float(temperature_c[row])
    same = np.flatnonzero(np.abs(temperature_c - end_c) < 0.5)
    row = int(same[np.argmax(np.abs(values[same]))])
    columns = {**channels.columns, TEMPERATURE: temperature_c + sign * BEYOND_K}
    moved = _of(law, replace(channels, columns=columns), axis)
    words = "above the warmest" if sign > 0 else "below the coldest"
    return (
        f"{BEYOND_K:g} K {words} data set it would be {moved[row]:.3g} deg/s in place of {values[row]:.3g} "
        f"({float(channels.rate_dps(axis)[row]):.4g} deg/s, {end_c:.4g} deg C)."
    )
