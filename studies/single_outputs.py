"""One output measured in three mountings: does the error fall to the noise floor, and does a verdict contradict itself?

The rates about the other two axes are known on the table, so the terms across are part of the model, and the residual
is the output against the model at the rate vector that was measured. `LABCTL_STUDY_VERDICTS` is how many verdicts are
asked for, `LABCTL_STUDY_SEED` the first seed.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

from labctl.fitting.criticism import criticise
from labctl.fitting.criticism.residual_limits import MAX_OVER_FLOOR
from labctl.fitting.estimation.fit import fit
from labctl.recording import Recording
from labctl.services.criticism.answer import sentences
from studies.campaigns import MODELS, campaign
from studies.effect_sizes import sizes

VERDICTS = int(os.environ.get("LABCTL_STUDY_VERDICTS", "200"))
SEED = int(os.environ.get("LABCTL_STUDY_SEED", "5000"))
PROTOCOL = "Y"
AXES = ("x", "y", "z")
#: Effects that a calibration can hold and that one output in three mountings shows; nothing at all comes as often.
HIDDEN = (
    "", "scale_factor_odd", "scale_factor_even", "scale_factor_asymmetry", "g_sensitivity", "mounting_shift",
    "supply_sensitivity", "temperature_rate", "cross_axis_nonlinearity", "warm_up",
)  # fmt: skip
SIZES = ("10", "30", "100")
#: Where an error has fallen to: a root mean square of some 200 data sets scatters by 5 %, and the fit adds its own.
AT_FLOOR = 1.25


@dataclass(frozen=True)
class Outcome:
    """One recording of one output: before and after its first missing effect was added."""

    hidden: str
    form: str
    named: tuple[str, ...]
    before_over_floor: float
    after_over_floor: float | None  #: beside the effect that is named first; None where none is
    text: str

    @property
    def contradicts(self) -> bool:
        """Whether the text calls a model adequate whose residual is far above the floor."""
        return "adequate" in self.text.lower() and self.before_over_floor > MAX_OVER_FLOOR


def of_one_output(recording: Recording, axis: str) -> Recording:
    """Return a recording without the outputs of the other axes."""
    others = {f"gyro_{name}" for name in recording.info.axes if name != axis}
    output = {name: unit for name, unit in recording.info.output.items() if name == axis}
    info = recording.info.model_copy(update={"axes": [axis], "output": output})
    columns = {name: values for name, values in recording.columns.items() if name not in others}
    return replace(recording, info=info, columns=columns)


def outcome_of(hidden: str, size: str, axis: str, seed: int) -> Outcome:
    """Record one output with an effect hidden in it, criticise its model, and add what is named first."""
    effects = {hidden: sizes(PROTOCOL)[hidden][size]} if hidden else {}
    recording = of_one_output(campaign(PROTOCOL, seed, effects), axis)
    fitted = fit(recording, MODELS[PROTOCOL])
    found = criticise(recording, fitted.fitted.model)
    floor = found.floor.rms_dps
    assert floor is not None
    assert fitted.error.rms_dps is not None
    after = fit(recording, MODELS[PROTOCOL], [found.verdict.named[0]]).error.rms_dps if found.verdict.named else None
    return Outcome(
        hidden, found.verdict.form, found.verdict.named, fitted.error.rms_dps / floor,
        None if after is None else after / floor, " ".join(sentences(found)),
    )  # fmt: skip


def run() -> str:
    """Return what was found, effect by effect, and every contradiction, in words."""
    outcomes = [
        outcome_of(HIDDEN[i % len(HIDDEN)], SIZES[(i // len(HIDDEN)) % len(SIZES)], AXES[i % len(AXES)], SEED + i)
        for i in range(VERDICTS)
    ]
    added = [each.after_over_floor for each in outcomes if each.after_over_floor is not None]
    fallen = sum(left <= AT_FLOOR for left in added)
    contradictions = [each for each in outcomes if each.contradicts]
    return "\n".join([
        "hidden                    n  right  before/floor   after/floor  forms",
        *(_line(hidden, [each for each in outcomes if each.hidden == hidden]) for hidden in HIDDEN),
        f"after the first named effect was added, {fallen} of {len(added)} are within {AT_FLOOR:g} of the floor",
        f"verdicts that contradict themselves: {len(contradictions)} of {len(outcomes)}",
        *(f"  {each.hidden or 'nothing'}, {each.before_over_floor:.1f} times: {each.text}" for each in contradictions),
    ])  # fmt: skip


def _line(hidden: str, here: Sequence[Outcome]) -> str:
    """Return one effect's line: the largest errors before and after."""
    right = sum(hidden in each.named if hidden else each.form == "adequate" for each in here)
    before = max((each.before_over_floor for each in here), default=0.0)
    after = max((each.after_over_floor for each in here if each.after_over_floor is not None), default=0.0)
    forms = ", ".join(f"{form} {n}" for form, n in Counter(each.form for each in here).most_common())
    return f"{hidden or 'nothing':24}{len(here):3}  {right:5}  {before:12.2f}  {after:12.2f}  {forms}"
