"""Temperature loops on a turning table: is a scale factor that lags named, and what is left of it at levels not seen?

Cells: nothing hidden, a lag of the scale factor, of the bias, of both, at 1 and 2 K/min, one axis and three. Named
right: every name is hidden in the record, and one that is hidden is named; where nothing is hidden, none. After adding
what was named, the criticism is made again, up to three times: all hidden are then in the model, and nothing else.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from labctl.fitting.criticism import criticise
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.effects import CATALOGUE
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.estimation.shapes import with_shapes
from labctl.fitting.models.presets import changed, preset_for
from labctl.recording import to_points
from studies.turned_units import Turned, turned_unit

#: Records of a cell with an effect, and of one without.
RECORDS = int(os.environ.get("LABCTL_LOOP_RECORDS", "20"))
EMPTY_RECORDS = int(os.environ.get("LABCTL_LOOP_EMPTY", "100"))
MODEL = ["bias", "bias_temperature", "scale_factor", "scale_factor_temperature"]
STEPS = 3


@dataclass(frozen=True)
class Outcome:
    """What one record gave."""

    first: tuple[str, ...]  #: named at first
    added: frozenset[str]  #: in the model at the end
    left_over_floor: tuple[float, float]  #: error at levels left out, before and after
    tau_error: float  #: of the scale factor's time constant, in its standard uncertainties; NaN without


def cells() -> dict[str, Turned]:
    """Return what is hidden in each cell."""
    return {
        "nothing": Turned(),
        "nothing, 2 K/min": Turned(speed_k_min=2.0),
        "scale 200 s": Turned(scale_lag_s=200.0),
        "scale 800 s": Turned(scale_lag_s=800.0),
        "scale 400 s, 2 K/min": Turned(scale_lag_s=400.0, speed_k_min=2.0),
        "scale 400 s, 2e-5/K": Turned(scale_lag_s=400.0, scale_1_k=2e-5),
        "bias 400 s": Turned(bias_lag_s=400.0),
        "both, 300 s and 600 s": Turned(scale_lag_s=300.0, bias_lag_s=600.0),
        "scale, 3 axes": Turned(scale_lag_s=400.0, axes=("x", "y", "z"), loops=1),
    }


def hidden_names(hidden: Turned) -> frozenset[str]:
    """Return what is hidden, by its names in the catalogue."""
    found = {"scale_factor_lag": hidden.scale_lag_s, "thermal_lag": hidden.bias_lag_s}
    return frozenset(name for name, tau_s in found.items() if tau_s)


def outcome(seed: int, hidden: Turned) -> Outcome:
    """Simulate, fit a polynomial of temperature, criticise, add what is named, until nothing is."""
    recording = turned_unit(seed, hidden)
    points = to_points(recording)
    data = fit_data_of(points)
    base = fit_preset(data, preset_for(None, MODEL if len(hidden.axes) == 1 else [*MODEL, "misalignment"]))
    fitted, first = base, None
    for _ in range(STEPS):
        found = criticise(recording, fitted.fitted.model, CATALOGUE, points=points, full=False)
        verdict = found.verdict
        first = verdict.named if first is None else first
        terms = tuple(verdict.terms[group[0]] for group in verdict.groups if group[0] in verdict.terms)
        if not terms:
            break
        fitted = fit_preset(data, with_shapes(data, changed(fitted.fitted.model, terms), all_of_them=True))
    added = frozenset(fitted.fitted.model.effect_ids) - frozenset(base.fitted.model.effect_ids)
    shape = fitted.shapes.get("scale_factor_lag", {}).get("tau_s")
    off = float("nan")
    if shape is not None and shape["u"] and hidden.scale_lag_s:
        off = (shape["value"] - hidden.scale_lag_s) / shape["u"]
    floor = float(base.error.noise_floor_dps or np.nan)
    left = [float(each.error.heldout_rms_dps or np.nan) / floor for each in (base, fitted)]
    return Outcome(first or (), added, (left[0], left[1]), off)


def lines() -> Iterator[str]:
    """Yield the table, row by row."""
    head = f"   {'cell':22} {'n':>4} {'right %':>8} {'false %':>8} {'whole %':>8}"
    yield f"{head}  held out over floor: before  after   tau off, u"
    for cell, hidden in cells().items():
        names = hidden_names(hidden)
        found = [outcome(seed, hidden) for seed in range(RECORDS if names else EMPTY_RECORDS)]
        right = 100 * np.mean([bool(set(one.first) & names) if names else not one.first for one in found])
        false = 100 * np.mean([bool((set(one.first) | one.added) - names) for one in found])
        whole = 100 * np.mean([one.added == names for one in found])
        before, after = np.nanmedian([one.left_over_floor for one in found], axis=0)
        off = np.array([one.tau_error for one in found])
        taus = f"{np.sqrt(np.nanmean(off**2)):.1f}" if np.isfinite(off).any() else "-"
        wrong = sorted({"+".join(sorted((set(one.first) | one.added) - names)) for one in found} - {""})
        yield (
            f"   {cell:22} {len(found):4d} {right:8.1f} {false:8.1f} {whole:8.1f} {before:28.2f} {after:6.2f} "
            f"{taus:>12}   {', '.join(wrong)}"
        )


def run() -> str:
    """Return the table."""
    return "\n".join(lines())


if __name__ == "__main__":
    for line in lines():
        print(line, flush=True)
