"""What a criticism says of causes that have no effect in the catalogue, and of what to add and what not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from labctl.answers.criticism import Advice, Experiment
from labctl.fitting.criticism import MIN_CAUSE, Criticism, Suspect
from labctl.fitting.effects import CATALOGUE
from labctl.probability_text import odds_text, probability_text
from labctl.services.criticism.next_experiment import MIN_NAMING, naming_probability
from labctl.shown_unit import shown_unit

#: From this share of the variance of several axes on, their slow courses are one.
COMMON = 0.8
#: From this probability on that an experiment names the cause alone, it is said to distinguish the effects.
LIKELY = 0.5
#: What to do about a temperature that was not logged.
LOG_IT = (
    "Log a second thermometer, near the sensing element or the electronics, or shield the unit from draught, sun and "
    "hands; then record again. An effect added for this residual would follow this record only."
)


def not_logged(criticism: Criticism) -> str:
    """Return the verdict on a residual at rest that wanders slowly; "" where there is no such hypothesis."""
    slow = criticism.slow
    if criticism.verdict.hypothesis != "temperature_not_logged" or slow is None:
        return ""
    sizes = ", ".join(f"{axis} {size:.2g} deg/s" for axis, size in slow["rms_dps"].items())
    together = slow["common"]
    common = (
        f"; one course explains {probability_text(together)} of it on all axes"
        if together is not None and together >= COMMON
        else ""
    )
    return (
        "The temperature that matters was not logged, or the bias itself drifts: nothing moved, and the residual "
        f"wanders ({sizes} RMS, correlated over {slow['tau_s'] / 60:.0f} min) in a way that the logged thermometer "
        f"does not explain{common}."
    )


def drifts(criticism: Criticism) -> str:
    """Return what is said of a slow process beside an adequate model, after a space; "" where there is none."""
    if criticism.slow is None:
        return ""
    return (
        f" It is a drift (correlated over {criticism.slow['tau_s'] / 60:.0f} min): of the bias, or of a temperature "
        "that "
        "was not logged."
    )


def what_to_log(criticism: Criticism) -> list[str]:
    """Return what to do about a temperature that was not logged; nothing without this hypothesis."""
    return [LOG_IT] if criticism.verdict.hypothesis is not None else []


def coarse_steps(criticism: Criticism) -> list[str]:
    """Return what is said of outputs whose steps the noise does not average out; nothing where there are none."""
    if not criticism.data.steps:
        return []
    axes = ", ".join(f"{axis} by {step['step_dps']:.3g} deg/s" for axis, step in criticism.data.steps.items())
    largest_step_dps = max(step["left_dps"] for step in criticism.data.steps.values())
    text = (
        f"Quantization: the output comes in steps ({axes}) that its noise does not average out. They leave "
        f"{largest_step_dps:.2g} deg/s (standard deviation) in a mean, which no model corrects: record at a finer "
        "resolution."
    )
    return [text]


def doubtful(criticism: Criticism) -> str:
    """Return what to say of evidence that is far beyond noise for an effect of an impossible size; "" without it."""
    verdict = criticism.verdict
    if verdict.form != "unexplained" or not verdict.not_physical:
        return ""
    technology = criticism.data.info.technology or "any technology"
    suspects = {suspect.candidate.id: suspect for suspect in criticism.suspects}
    parts = [_doubt(name, suspects.get(name), criticism, technology) for name in verdict.not_physical]
    return f"More than noise is left, but what resembles it is physically doubtful: {'; '.join(parts)}."


def _doubt(name: str, suspect: Suspect | None, criticism: Criticism, technology: str) -> str:
    if suspect is None:
        return f"{name} would have a size that is not physical for {technology}"
    before = criticism.base.error.rms_dps if criticism.base is not None else None
    after = suspect.after.error.rms_dps if suspect.after is not None else None
    change = ""
    if before is not None and after is not None:
        change = f" would lower the error from {before:.3g} to {after:.3g} deg/s, but"
    return f"{name}{change} {_size(name, suspect, technology)}"


def _size(name: str, suspect: Suspect, technology: str) -> str:
    """Return the size that an effect would have, on the axis where it is largest, and what is usual."""
    firsts = [next(iter(by_name.values())) for by_name in suspect.coefficients.values() if by_name]
    values = max(firsts, key=lambda first: abs(first["value"]))
    usual = suspect.kind.ranges.get(technology)
    shown = shown_unit(values["unit"], name)
    size = f"its size would be {shown.number(values['value'])} {shown.unit}"
    if usual is None:
        return size
    return f"{size}, where {shown.number(usual[0], 6)} to {shown.number(usual[1], 6)} is usual for {technology}"


#: What is said where effects cannot be distinguished by their size either.
NO_TECHNOLOGY = (
    "The technology of the gyro is not stated, so no size of these effects is usual or unusual: import the recording "
    "again with it (Technology, or technology in recording.toml); it then says which of them such a gyro has."
)


def unusual_sizes(criticism: Criticism) -> list[str]:
    """Return which of the effects that cannot be distinguished would be of an unusual size, where another would not."""
    named, technology = criticism.verdict.indistinguishable, criticism.data.info.technology or ""
    if criticism.verdict.form == "ambiguous" and not technology:
        return [NO_TECHNOLOGY]
    suspects = [suspect for suspect in criticism.suspects if suspect.candidate.id in named]
    usual = [suspect.candidate.id for suspect in suspects if suspect.is_usual(technology)]
    unusual = [suspect for suspect in suspects if suspect.is_usual(technology) is False]
    if criticism.verdict.form != "ambiguous" or not usual or not unusual:
        return []
    sizes = "; ".join(
        f"{each.candidate.id} would not: {_size(each.candidate.id, each, technology)}" for each in unusual
    )
    return [f"{', '.join(usual)} would be of a usual size; {sizes}."]


def to_distinguish(effects: Sequence[str], experiments: Sequence[Experiment]) -> list[str]:
    """Return what distinguishes effects: the first experiment, or that none is expected to; without any the usual ones.

    An experiment that is not expected to name the cause (`LIKELY`) is not recommended as if it did.
    """
    if not experiments:
        usual = dict.fromkeys(CATALOGUE[each].experiment for each in effects[:3] if each in CATALOGUE)
        return [f"To distinguish them: {experiment}." for experiment in usual]
    first = experiments[0]
    naming = naming_probability(first)
    if naming >= LIKELY:
        return [f"To distinguish them: {first['do']}."]
    if naming >= MIN_NAMING:
        surer = next((each for each in experiments[1:] if naming_probability(each) >= LIKELY), None)
        more = f" {probability_text(surer['power'])} needs more time: {surer['do']}." if surer is not None else ""
        text = (
            "The best experiment for its time names one cause alone with a probability of only "
            f"{probability_text(first['power'])}: {first['do']}.{more}"
        )
        return [text]
    share = first["information_bit"] / first["open_bit"]
    text = (
        "No experiment that labctl can plan from these data is expected to name one cause alone; this one tells "
        f"most about how probable each effect is, {probability_text(share)} of the missing information: {first['do']}."
    )
    return [text]


def beyond_the_rates(criticism: Criticism, experiments: Sequence[Experiment]) -> list[str]:
    """Return where laws of the rate differ, if no experiment is likely to distinguish them; nothing for other effects.

    Experiments are changes of a recipe like the recording, and go to no higher rate.
    """
    is_likely = any(naming_probability(each) >= LIKELY for each in experiments[:1])
    alike = criticism.verdict.indistinguishable
    if (
        not experiments
        or is_likely
        or not all(name in CATALOGUE and CATALOGUE[name].bends_at_high_rates for name in alike)
    ):
        return []
    largest_dps = float(np.max(np.abs(criticism.data.at_sets(criticism.data.nodes.table_rate_dps()))))
    text = (
        f"Up to {largest_dps:.4g} deg/s these laws of the rate are nearly the same, and no experiment that labctl "
        "plans goes to higher rates: they differ most there, as far as gyro and table allow them."
    )
    return [text]


def advice_sentences(criticism: Criticism) -> list[str]:
    """Return what to add and what not, one sentence for each effect that was named.

    What is advised of several effects that cannot be distinguished is the one with the most evidence, also where
    another one would leave a little less error.
    """
    return [_advised(each, criticism) for each in criticism.advice]


def _advised(advice: Advice, criticism: Criticism) -> str:
    if not advice["checked"]:
        return f"Whether to add {advice['effect']} is not known: {advice['why']}."
    if not advice["add"]:
        return f"Do not add {advice['effect']}: {advice['why']}."
    return (
        f"Adding {advice['effect']} is advised{_first_of_group(advice['effect'], criticism)}: on the parts left out of "
        f"the fit, the exported calibration then leaves an error of {advice['after_dps']:.3g} deg/s, now "
        f"{advice['before_dps']:.3g} deg/s."
    )


def _first_of_group(effect: str, criticism: Criticism) -> str:
    """Return why an effect is advised and not those that the data cannot tell from it, after a comma; "" alone."""
    group = next((group for group in criticism.verdict.groups if effect in group), (effect,))
    if len(group) == 1:
        return ""
    text = f", of {len(group)} effects that cannot be distinguished the one with the most evidence"
    log_bf = {each.candidate.id: each.candidate.log_bf for each in criticism.suspects if each.candidate.id in group}
    others = sorted((name for name in log_bf if name != effect), key=log_bf.__getitem__, reverse=True)
    if effect not in log_bf or not others:
        return text
    lead = log_bf[effect] - log_bf[others[0]]
    if lead < 0.0:
        return f"{text} that a calibration can carry"
    return f"{text}, {odds_text(lead)} against {others[0]}"


def why_not_named(criticism: Criticism) -> str:
    """Return why an adequate model has suspects that are not named, and what they would be worth; "" without any."""
    names = {name for group in criticism.verdict.further for name in group}
    if not names or criticism.base is None:
        return ""
    suspects = sorted(
        (suspect for suspect in criticism.suspects if suspect.candidate.id in names),
        key=lambda suspect: -suspect.candidate.log_bf,
    )
    odds = {suspect.candidate.id: f" ({_odds(suspect)})" for suspect in suspects}
    listed = ", ".join(f"{name}{odds.get(name, '')}" for name in (*odds, *sorted(names - set(odds))))
    reasons = ["these odds hold only where the noise is exactly as it was estimated"] if odds else []
    chance = criticism.lack_of_fit[1]
    if chance is not None:
        reasons.append(f"noise alone leaves a residual as large as this one in {probability_text(chance)} of cases")
    if suspects and all(suspect.share_removed < MIN_CAUSE for suspect in suspects):
        each = "each takes off" if len(suspects) > 1 else "it takes off"
        reasons.append(f"{each} less than {probability_text(MIN_CAUSE)} of the error above the noise floor")
    because = f": {'; '.join(reasons)}" if reasons else ""
    return f"Suspected and not named: {listed}{because}.{_worth(criticism, suspects)}"


def _odds(suspect: Suspect) -> str:
    without_fit = ", but the model with it cannot be fitted" if suspect.refused else ""
    return f"{odds_text(suspect.candidate.log_bf)}{without_fit}"


def _worth(criticism: Criticism, suspects: Sequence[Suspect]) -> str:
    """Return how far the error falls with the best of the suspects, after a space; "" where it does not."""
    before = criticism.base.error.rms_dps if criticism.base is not None else None
    after = {suspect.candidate.id: suspect.after.error.rms_dps for suspect in suspects if suspect.after is not None}
    fitted = {name: rms_dps for name, rms_dps in after.items() if rms_dps is not None}
    best = min(fitted, key=fitted.__getitem__, default="")
    if before is None or not best or fitted[best] >= before:
        return ""
    which = "it" if len(suspects) == 1 else best
    return f" With {which} the error falls from {before:.4g} to {fitted[best]:.4g} deg/s."
