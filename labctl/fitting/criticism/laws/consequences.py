"""What else would follow from a law: its symmetry, and its values beyond what was measured, in sentences."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from labctl.fitting.criticism.criticism import Criticism
from labctl.fitting.criticism.laws.proposals import Law, added_dps, at_rates, where_finite
from labctl.fitting.criticism.laws.shapes import TEMPERATURE
from labctl.fitting.data.channels import Channels
from labctl.fitting.effects.formula import RATES, Formula
from labctl.fitting.numeric.arrays import Array

#: A law is even or odd in the rate where less than this share of it is not.
SYMMETRIC = 0.02
#: Beyond the fastest rate by this share, and beyond the temperatures by so much, K.
FASTER, BEYOND_K = 0.25, 10.0
#: Data sets this near to the warmest or coldest are at the end of the range, K.
SAME_C = 0.5


def consequences(law: Law, criticism: Criticism) -> list[str]:
    """Return what else would follow from a law, one sentence each, on the axis on which it adds most."""
    data, base = criticism.fit_data, criticism.base
    if base is None:
        return []
    channels = data.channels
    added = {axis: added_dps(law.fit, base, channels, axis) for axis in data.outputs}
    axis = max(added, key=lambda name: float(np.abs(added[name]).max()))
    if not _has_rate(law):
        sentences = ["It does not depend on the rate."]
    else:
        sentences = [_symmetry(law, channels, axis)]
        row = int(np.argmax(np.abs(channels.rate_dps(axis))))
        fastest_dps = float(abs(channels.rate_dps(axis)[row]))
        if (1 + FASTER) * fastest_dps <= (data.info.max_rate_dps or np.inf):
            then = where_finite(partial(added_dps, law.fit, base, at_rates(channels, axis, 1 + FASTER), axis))
            sentences.append(_beyond(f"{(1 + FASTER) * fastest_dps:.4g} deg/s", then, added[axis], row))
    if any(TEMPERATURE in text for text in law.formulas):
        for sign, end in ((1, "warmest"), (-1, "coldest")):
            row = _row_at_end(sign * data.temperature_c, added[axis])
            warm_c = data.temperature_c + sign * BEYOND_K
            moved = replace(channels, columns={**channels.columns, TEMPERATURE: warm_c})
            at = f"{warm_c[row]:.4g} deg C, {BEYOND_K:g} K beyond the {end} data set"
            then = where_finite(partial(added_dps, law.fit, base, moved, axis))
            sentences.append(_beyond(at, then, added[axis], row))
    return sentences


def _beyond(where: str, then: Array | None, now: Array, row: int) -> str:
    if then is None:
        return f"At {where}, where nothing was measured, it has no finite value: it describes the measured range only."
    return (
        f"At {where}, where nothing was measured, it would add {then[row]:.3g} deg/s to what the model expects; at the "
        f"nearest data set it adds {now[row]:.3g} deg/s."
    )


def _row_at_end(rising: Array, added: Array) -> int:
    """Return the data set at the end of a range at which most is added."""
    at_end = np.flatnonzero(rising > rising.max() - SAME_C)
    return int(at_end[np.argmax(np.abs(added[at_end]))])


def law_dps(law: Law, channels: Channels, axis: str) -> Array:
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


def _symmetry(law: Law, channels: Channels, axis: str) -> str:
    there, back = (law_dps(law, at_rates(channels, axis, share), axis) for share in (1.0, -1.0))
    at_rest = law_dps(law, at_rates(channels, axis, 0.0), axis)
    size = max(float(np.abs(there).max()), 1e-300)
    rest = float(np.abs(at_rest).max())
    if float(np.abs(there + back).max()) < SYMMETRIC * size:
        return "It changes its sign with the direction of the rate, and is 0 at rest."
    if float(np.abs(there - back).max()) < SYMMETRIC * size:
        there_at_rest = f"up to {rest:.3g} deg/s" if rest > SYMMETRIC * size else "0"
        return f"It is the same in both directions of the rate; at rest it is {there_at_rest}."
    return "It differs between the directions of the rate by more than its sign."
