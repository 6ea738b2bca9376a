"""Cells of verdicts: recipe x starting model x what is hidden x size, and the shares of each kind of answer.

`python -m studies.verdict_cells [PART ...]` prints one line for each cell whose name has all these parts;
`LABCTL_STUDY_CAMPAIGNS` is how many campaigns a cell has.
"""

from __future__ import annotations

import os
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from labctl.errors import LabctlError
from labctl.fitting.criticism import Verdict, criticise
from labctl.fitting.criticism.evidence.elimination import eliminate_base
from labctl.fitting.criticism.evidence.noise_grid import Noise, expected_drift_dps
from labctl.fitting.criticism.model_comparison import design_of
from labctl.fitting.criticism.reduction import reduce_recording
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.models.presets import preset_for
from labctl.recording import Recording
from labctl.services.simulation.recordings import SimulateRequest, make_recording
from studies.campaigns import MODELS, OUTSIDE, PROTOCOLS, campaign
from studies.effect_sizes import sizes
from studies.outside_catalogue import KINDS
from studies.report_tables import wilson

PER_CELL = int(os.environ.get("LABCTL_STUDY_CAMPAIGNS", "20"))
#: Sizes of hidden effects, in noise units; beyond 100 in proportion.
Z_LEVELS = (5, 10, 30, 100, 300, 1000, 3000)
#: What the law of a simulated RD2100 has and `bias_scale` has not: v^2 and v^3 of the rate.
BEND = ("scale_factor_odd", "scale_factor_even")
#: Recipe, starting model, and what the unit's own law has beyond that model; nothing hidden. Beside the protocols'.
PLAIN: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("gyrostar", "weiss1995", ()), ("gyrostar", "ojeda2000", ()), ("gyrostar", "bias_scale", ()),
    ("ojeda2000", "ojeda2000", ()), ("ojeda2000", "bias_scale", BEND), ("short", "bias_scale", BEND),
    ("quick-triaxial", "yang2018", ()), ("informative", "yang2018", ()), ("informative", "bias_scale", ()),
)  # fmt: skip
#: Recipe, starting model, and the largest value, deg/s, of an error outside the catalogue that is added there.
FOREIGN = (
    ("ojeda2000", "ojeda2000", 0.03),
    ("ojeda2000", "ojeda2000", 1.0),
    ("gyrostar", "weiss1995", 0.5),
    ("informative", "yang2018", 0.03),
)
READINGS_HZ = 4.0
#: The part of an error that the model leaves cannot be seen below this size, in noise units.
MIN_Z = 5.0


@dataclass(frozen=True)
class Case:
    """One campaign, the model that it starts from, and what a right answer says."""

    recording: Callable[[], Recording]
    model: str
    effects: tuple[str, ...] = ()  #: hidden, each of the catalogue
    channels: tuple[str, ...] = ()  #: of what is hidden that no effect of the catalogue describes
    plain: Callable[[], Recording] | None = None  #: the same recording without what no effect describes


@lru_cache(maxsize=64)
def plain(recipe: str, seed: int) -> Recording:
    """Return a recording of a recipe with nothing hidden."""
    return make_recording(SimulateRequest(recipe=recipe, seed=seed, sample_rate_hz=READINGS_HZ)).recording


def cells() -> Iterator[tuple[str, list[Case]]]:
    """Yield the name and the campaigns of every cell."""
    seeds = range(PER_CELL)
    for recipe, model, effects in PLAIN:
        yield f"nothing/{recipe}/{model}", [Case(partial(plain, recipe, seed), model, effects) for seed in seeds]
    for name in PROTOCOLS:
        yield f"nothing/{name}", [_of_protocol(name, 10_000 + seed, {}) for seed in seeds]
        for z in Z_LEVELS:
            yield f"effect/{name}/z{z}/", list(_hidden(name, z))
    for recipe, model, size_dps in FOREIGN:
        for kind in KINDS:
            channels = KINDS[kind].channels
            made = [
                Case(partial(_added, recipe, kind, size_dps, s), model, (), channels, partial(plain, recipe, s))
                for s in seeds
            ]
            yield f"outside/{recipe}/{model}/{size_dps:g}/{kind}", made


def _of_protocol(name: str, seed: int, hidden: dict[str, float]) -> Case:
    return Case(partial(campaign, name, seed, hidden), MODELS[name], tuple(hidden))


def _hidden(name: str, z: int) -> Iterator[Case]:
    """Yield campaigns with one effect hidden, drawn evenly from those that the protocol can show."""
    sized = sizes(name)
    inside = sorted(effect for effect in set(sized) - set(OUTSIDE) if "100" in sized[effect])
    for k in range(PER_CELL):
        effect = inside[k % len(inside)]
        yield _of_protocol(name, 20_000 + k, {effect: sized[effect].get(f"{z}", sized[effect]["100"] * z / 100)})


def _added(recipe: str, kind: str, size_dps: float, seed: int) -> Recording:
    return KINDS[kind].added(plain(recipe, seed), seed, size_dps)


def verdict_of(case: Case) -> Verdict:
    """Return what is said about a campaign; insufficient data where the model cannot even be fitted."""
    recording = case.recording()
    try:
        model, _ = preset_for(case.model, []).build(fit_data_of(recording))
        return criticise(recording, model, full=False).verdict
    except LabctlError as error:
        return Verdict("insufficient_data", reason=str(error))


def _is_absorbed(case: Case) -> bool:
    """Return whether the starting model absorbs what was added, so that nothing of it is left to be seen.

    A table with a node at each temperature absorbs any law of temperature.
    """
    if case.plain is None:
        return False
    before, after = (reduce_recording(recording, outliers=False) for recording in (case.plain(), case.recording()))
    model, _ = preset_for(case.model, []).build(fit_data_of(case.plain()))
    z_squared = 0.0
    for axis in before.info.axes:
        design = replace(design_of(before, model, axis, {}), options=[])
        assert before.white_var is not None
        white = before.white_var[axis]
        scale = np.repeat(np.sqrt(white)[None, :], len(before.output[axis]), axis=0)
        drift = expected_drift_dps(before.info.technology or "", before.info.stability_dps)
        difference = after.output[axis] - before.output[axis]
        z_squared += eliminate_base(design, difference, white, scale, [Noise(drift, 0.0, 0.0)])[0].chi2
    return bool(z_squared < MIN_Z**2)


def score(case: Case, verdict: Verdict) -> str:
    """Return what kind of answer it is: right, honest (no name), missed, unseen (absorbed), or which kind of wrong."""
    named = set(verdict.named)
    if not case.effects and named:
        return "wrong alone" if any(len(group) == 1 for group in verdict.groups) else "wrong"
    if not case.effects and case.channels:
        if verdict.form != "unexplained":
            return "unseen" if _is_absorbed(case) else "missed"
        said = {*verdict.depends_on[:1], *verdict.confounded}
        return "right" if said & set(case.channels) else "other channel"
    if not named:
        honest = "honest" if verdict.form == "unexplained" else "missed"
        return "right" if not case.effects and verdict.form == "adequate" else honest
    if not set(case.effects) & named:
        return "wrong alone" if any(len(group) == 1 for group in verdict.groups) else "wrong"
    return "extra" if any(not set(group) & set(case.effects) for group in verdict.groups) else "right"


def line(name: str, cases: list[Case], *, said: bool) -> str:
    """Return one cell's counts, its share of right answers with the 95 % interval, and the seconds of one answer.

    Nothing said of what the model absorbs is right.
    """
    counts: Counter[str] = Counter()
    begun = time.process_time()
    for case in cases:
        verdict = verdict_of(case)
        kind = score(case, verdict)
        counts[kind] += 1
        if said and kind != "right":
            also = (verdict.depends_on[:2], verdict.confounded, dict(verdict.remainder or {}))
            print(f"   {kind}: {case.effects} {verdict.form} {verdict.groups} {also}", flush=True)
    right = counts["right"] + counts["unseen"]
    low, high = wilson(right, len(cases))
    seconds = (time.process_time() - begun) / len(cases)
    share = f"{100 * right / len(cases):.0f} ({100 * low:.0f} to {100 * high:.0f})"
    return f"{name:45} {share:18} {dict(counts)} {seconds:.1f} s"


def run(parts: list[str] | None = None, *, said: bool = False) -> str:
    """Print each cell as it is done, and return all lines."""
    lines = []
    for name, cases in cells():
        if all(part in name for part in parts or []):
            lines.append(line(name, cases, said=said))
            print(lines[-1], flush=True)
    return "\n".join(lines)


if __name__ == "__main__":
    run([part for part in sys.argv[1:] if part != "--said"], said="--said" in sys.argv)
