"""Temperature loops at rest, 2 K/min: is a hidden lag or hysteresis named, and what is left of it on a leg not seen?

Cells: lags of 300, 600 and 900 s, hysteresis of 3 to 8 K, both, neither; of three axes lags of their own, of two flows,
slower while the unit cools; a lag with self-heating. Named right: the verdict names what is hidden,
alone or in a group of what it cannot be distinguished from. Leg: every leg left out in turn and predicted by the
others, over the noise floor, before and after adding what was named first of each group.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from labctl.fitting.criticism import Criticism, criticise
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.effects import CATALOGUE, Term
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.estimation.shapes import with_shapes
from labctl.fitting.models.presets import changed, preset_for
from labctl.recording import to_points
from studies.rest_units import DRIFT_DPS, WHITE, WINDOW_S, Hidden, unit_at_rest

#: Campaigns of a cell.
CAMPAIGNS = int(os.environ.get("LABCTL_REST_CAMPAIGNS", "100"))
Z = 30.0
#: Factors of the time constants of three axes.
AXES = (0.7, 1.0, 1.5)
#: Noise of the mean of a window, white and drift.
NOISE_DPS = float(np.hypot(WHITE / np.sqrt(WINDOW_S), DRIFT_DPS))


@dataclass(frozen=True)
class Outcome:
    """What one campaign gave."""

    right: bool
    named: tuple[str, ...]
    form: str
    leg_before: tuple[float, float]  #: held-out leg over the floor as stated, and as simulated
    leg_after: tuple[float, float]


def cells() -> dict[str, tuple[Hidden, frozenset[str]]]:
    """Return what is hidden in each cell, and its names in the catalogue."""
    lag, hysteresis = frozenset({"thermal_lag"}), frozenset({"thermal_hysteresis"})
    return {
        "neither": (Hidden(), frozenset()),
        **{f"lag {tau:.0f} s": (Hidden(lag_s=tau, z=Z), lag) for tau in (300.0, 600.0, 900.0)},
        **{f"hysteresis {w:.0f} K": (Hidden(width_k=w, z=Z), hysteresis) for w in (3.0, 8.0)},
        "both": (Hidden(lag_s=600.0, width_k=5.0, z=Z), lag | hysteresis),
        "neither, 3 axes": (Hidden(of_axes=AXES), frozenset()),
        "lag by axis": (Hidden(lag_s=400.0, of_axes=AXES, z=Z), lag),
        "two flows": (Hidden(lag_s=60.0, second=(0.5, 1200.0), of_axes=AXES, z=Z), lag),
        "slower to cool": (Hidden(lag_s=300.0, cooling=2.5, of_axes=AXES, z=Z), lag),
        "lag, self-heating": (Hidden(lag_s=400.0, heating_s=1500.0, z=Z), lag | {"self_heating"}),
    }


def outcome(seed: int, hidden: Hidden, names: frozenset[str]) -> Outcome:
    """Simulate, fit the parabola of temperature, criticise, add what is named, fit again."""
    recording = unit_at_rest(seed, hidden)
    points = to_points(recording)
    data = fit_data_of(points)
    base = fit_preset(data, preset_for("bias_temperature", []))
    found = criticise(recording, base.fitted.model, CATALOGUE, points=points, full=False)
    groups = found.verdict.groups
    named = tuple(name for group in groups for name in group)
    right = not groups and found.verdict.form == "adequate" if not names else names <= set(named)
    better = with_shapes(data, changed(base.fitted.model, _terms(found)), all_of_them=True)
    after = fit_preset(data, better) if groups else base
    return Outcome(right, named, found.verdict.form, _leg(base), _leg(after))


def _terms(found: Criticism) -> tuple[Term, ...]:
    return tuple(found.verdict.terms[group[0]] for group in found.verdict.groups if group[0] in found.verdict.terms)


def _leg(result: FitResult) -> tuple[float, float]:
    """Return the error of legs left out over the floor that is stated, and over the noise that was simulated."""
    by_leg = {leg["fitted"]: leg["rms_dps"] for leg in result.error.heldout_by_leg}
    found = by_leg.get("all legs but one")
    leg = float("nan") if found is None else found
    return leg / float(result.error.noise_floor_dps or np.nan), leg / NOISE_DPS


def lines() -> Iterator[str]:
    """Yield the table, row by row."""
    yield f"   n = {CAMPAIGNS} a cell, z = {Z:g}"
    yield f"   {'cell':18} {'right %':>8}  leg over floor: before  after  (floor simulated: after)   forms; wrong names"
    for cell, (hidden, names) in cells().items():
        found = [outcome(seed, hidden, names) for seed in range(CAMPAIGNS)]
        right = 100.0 * np.mean([one.right for one in found])
        before, after, true = np.nanmedian([(one.leg_before[0], *one.leg_after) for one in found], axis=0)
        forms = {form: sum(one.form == form for one in found) for form in sorted({one.form for one in found})}
        wrong = sorted({"+".join(one.named) or "-" for one in found if not one.right})
        yield f"   {cell:18} {right:8.1f} {before:23.2f} {after:6.2f} {true:25.2f}   {forms} {', '.join(wrong)}"


def run() -> str:
    """Return the table."""
    return "\n".join(lines())


if __name__ == "__main__":
    for line in lines():
        print(line, flush=True)
