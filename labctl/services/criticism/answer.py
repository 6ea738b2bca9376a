"""The answer of a criticism: figures under the contract's keys, and the verdict in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from labctl.answers.criticism import CriticisedNoise, CriticismResponse, Experiment, LackOfFit
from labctl.answers.criticism import Suspect as SuspectJson
from labctl.answers.inspection import DataWarning
from labctl.fitting.criticism import (
    Criticism,
    Suspect,
    Verdict,
    has_one_rising_leg,
    residual_maps,
    where_it_fails,
    worst_data_sets,
)
from labctl.fitting.effects import CATALOGUE
from labctl.probability_text import probability_text
from labctl.services.criticism.advice_text import (
    advice_sentences,
    beyond_the_rates,
    coarse_steps,
    doubtful,
    drifts,
    not_logged,
    to_distinguish,
    unusual_sizes,
    what_to_log,
    why_not_named,
)

#: How a warning begins that stands before a verdict.
DATA_FIRST = {"certain": "The data are wrong", "likely": "Check the data"}


def with_warnings(answer: CriticismResponse, warnings: list[DataWarning]) -> CriticismResponse:
    """Return an answer that says first what is wrong with the data: a verdict on wrong data means nothing."""
    warnings_text = [f"{DATA_FIRST[warning.severity]}: {warning.text}." for warning in warnings]
    return answer.model_copy(update={"warnings": [*warnings, *answer.warnings], "text": [*warnings_text, *answer.text]})


#: Up to this many noise floors an error counts as noise: a model does not follow drift, and points that are measured
#: again, from which a noise floor may come, share some of the drift.
AT_FLOOR = 1.25
#: Of a recording whose rates were commanded, and not measured.
UNMEASURED = (
    "The reference is the commanded rate of the table, not a measured one: a constant error of the table rate "
    "(table_rate_ratio) therefore looks exactly like an error of the scale factor (scale_factor) and is part of "
    "it. No reading of the gyro can distinguish the two; an encoder, an index pulse or a count of whole turns can."
)
#: Channels that run on while temperatures rise.
HISTORY = frozenset({"t_s", "power_s"})


def answer_of(
    serial: str, version: int, recordings: Sequence[int], criticism: Criticism, experiments: list[Experiment]
) -> CriticismResponse:
    """Return the answer of a criticism."""
    verdict, base = criticism.verdict, criticism.base
    return CriticismResponse(
        serial=serial,
        version=version,
        recording=recordings[-1],
        recordings=list(recordings),
        verdict=verdict.form,
        text=[*sentences(criticism, experiments), *(base.joint["text"] if base and base.joint else ())],
        joint=base.joint if base else None,
        error={
            "rms_dps": base.error.rms_dps if base else None,
            "heldout_rms_dps": base.error.heldout_rms_dps if base else None,
            "noise_floor_dps": criticism.floor.rms_dps,
            "noise_floor_source": criticism.floor.source,
            "explained": criticism.explained,
            "direct_form_rms_dps": criticism.direct_rms_dps,
        },
        noise=_noise(criticism),
        lack_of_fit=_lack_of_fit(criticism),
        where=where_it_fails(criticism.data, criticism.residuals) if criticism.comparison else [],
        suspects=[_suspect(suspect, criticism) for suspect in criticism.suspects],
        named=list(verdict.named),
        depends_on=list(verdict.depends_on),
        confounded_with=list(verdict.confounded),
        remainder=verdict.remainder,
        thermal_response=criticism.family.to_json() if criticism.family is not None else None,
        thermal_hint=criticism.hint.hint_json() if criticism.hint is not None else None,
        not_physical=list(verdict.not_physical),
        named_axes={name: list(axes) for name, axes in verdict.axes.items()},
        further=[list(group) for group in verdict.further],
        why_not_named=why_not_named(criticism),
        not_testable=list(criticism.not_testable),
        experiments=experiments,
        worst=worst_data_sets(criticism.data, criticism.residuals) if criticism.comparison else [],
        maps=residual_maps(criticism.data, criticism.residuals) if criticism.comparison else [],
        readings_left_out=criticism.data.left_out,
        views=criticism.views,
        hypothesis=verdict.hypothesis,
        slow_process=criticism.slow,
        output_steps=dict(criticism.data.steps),
        advice=list(criticism.advice),
        next_effect=criticism.next_effect,
    )


def _noise(criticism: Criticism) -> CriticisedNoise:
    static = criticism.data.static.to_json() if criticism.data.static is not None else None
    largest = max(criticism.floor.axes.values(), key=lambda noise: noise.drift.drift_dps)
    known = [noise.white_dps for noise in criticism.floor.axes.values() if noise.white_dps is not None]
    if not known:
        return {"white_dps": None, "drift_dps": None, "drift_tau_s": None, "vs_datasheet": None, "static": static}
    return {
        "white_dps": float(np.sqrt(np.mean(np.square(known)))),
        "drift_dps": largest.drift.drift_dps,
        **largest.correlation_times,
        "vs_datasheet": criticism.drift_over_datasheet,
        "static": static,
    }


def _lack_of_fit(criticism: Criticism) -> LackOfFit:
    statistic, p_value = criticism.lack_of_fit
    return {"statistic": statistic, "p_value": p_value}


def _suspect(suspect: Suspect, criticism: Criticism) -> SuspectJson:
    candidate, kind = suspect.candidate, suspect.kind
    after = suspect.after.error if suspect.after else None
    technology = criticism.data.info.technology or ""
    return {
        "effect": candidate.id,
        "probability": suspect.probability,
        "p_value": suspect.p_value,
        "log_bayes_factor": candidate.log_bf,
        "share_removed": suspect.share_removed,
        "coefficients": {axis: dict(values) for axis, values in suspect.coefficients.items()},
        "coefficients_from": "fit" if suspect.is_fitted else "comparison",
        "parameters": _shape(suspect),
        "physical": candidate.physical,
        "plausible": list(kind.ranges[technology]) if technology in kind.ranges else None,
        "usual_size": suspect.is_usual(technology),
        "rms_after_dps": after.rms_dps if after else None,
        "heldout_rms_after_dps": after.heldout_rms_dps if after else None,
        "fit_refused": suspect.refused or None,
        "alias_group": list(suspect.group),
        "origin": kind.origin,
        "explanation": kind.sentence,
        "experiment": kind.experiment,
    }


def _shape(suspect: Suspect) -> dict[str, float]:
    """Return the nonlinear parameters that go with a suspect's coefficients."""
    term = suspect.candidate.term
    if suspect.is_fitted and suspect.after is not None:
        term = next(each for each in suspect.after.fitted.model.terms if each.effect == suspect.candidate.id)
    return dict(term.parameters) if term else {}


def sentences(criticism: Criticism, experiments: Sequence[Experiment] = ()) -> list[str]:
    """Return the verdict in words, one sentence each, the answer first; what to do next is the first experiment."""
    verdict = criticism.verdict
    family = [] if criticism.family is None else [criticism.family.sentence]
    family += [] if criticism.hint is None else [criticism.hint.hint]
    first = not_logged(criticism) or doubtful(criticism) or _first(criticism)
    answer_text = [first, *family, *what_to_log(criticism), *coarse_steps(criticism)]
    if verdict.remainder is not None and verdict.groups:
        answer_text.append(_remainder(verdict))
    if verdict.form == "unexplained" and verdict.confounded:
        answer_text.append(
            f"This schedule cannot distinguish {verdict.depends_on[0]} from {_list(verdict.confounded)}: confounded."
        )
    if _leg(criticism) and (verdict.groups or verdict.form == "unexplained"):
        answer_text.append(
            "Since the temperature only rises in this recording, an error that grows with time cannot be "
            "distinguished from one that grows with temperature."
        )
    answer_text += unusual_sizes(criticism)
    if verdict.form == "ambiguous" and verdict.indistinguishable:
        answer_text += to_distinguish(verdict.indistinguishable, experiments)
        answer_text += beyond_the_rates(criticism, experiments)
    answer_text += advice_sentences(criticism)
    if verdict.not_physical and verdict.groups:
        technology = criticism.data.info.technology or "this technology"
        answer_text.append(
            f"Equivalent in these data, but not physical for {technology}: {_list(verdict.not_physical)}."
        )
    answer_text += [text for text in (why_not_named(criticism),) if text]
    if criticism.data.info.rate_reference == "demanded":
        answer_text.append(UNMEASURED)
    if verdict.form == "adequate" and criticism.has_large_drift:
        answer_text.append(
            f"The drift is larger than specified: {criticism.drift_over_datasheet:.1f} times the value expected from "
            "the data sheet."
        )
    if criticism.data.left_out:
        answer_text.append(f"{criticism.data.left_out} readings far outside their data set were left out.")
    return answer_text


def _remainder(verdict: Verdict) -> str:
    left = verdict.remainder
    assert left is not None
    share, channels = float(left["share"]), left["depends_on"]
    follows = f", and follows {channels[0]}" if channels else ""
    return (
        f"{' and '.join(group[0] for group in verdict.groups)} {'explains' if len(verdict.groups) == 1 else 'explain'} "
        f"{probability_text(1.0 - share)} of the excess over the noise floor; the remaining residual is "
        f"{float(left['over_floor']):.1f} times the noise floor{follows}."
    )


def _leg(criticism: Criticism) -> bool:
    """Return whether temperatures only rose, and the verdict names what such a schedule cannot tell from time."""
    kinds = [CATALOGUE[name] for name in criticism.verdict.named if name in CATALOGUE]
    of_time = any(HISTORY & set(kind.needs) for kind in kinds) or bool(HISTORY & set(criticism.verdict.depends_on[:1]))
    if not of_time and "temperature_c" not in criticism.verdict.depends_on[:1]:
        return False
    return has_one_rising_leg(criticism.data)


def _list(names: Sequence[str]) -> str:
    return ", ".join(names)


def _adequate(criticism: Criticism) -> str:
    floor, left = criticism.floor.rms_dps, criticism.base.error.rms_dps if criticism.base else None
    if not floor or left is None or left <= AT_FLOOR * floor:
        return "Adequate: no effect is missing, the residual is noise."
    return (
        f"Adequate: no effect is missing that this recording can detect; the residual is {left / floor:.1f} times the "
        f"noise floor, and depends on no recorded channel.{drifts(criticism)}"
    )


def _first(criticism: Criticism) -> str:
    verdict = criticism.verdict
    words = [" or ".join(map(_word, group)) + _on_axes(group, criticism) for group in verdict.groups]
    match verdict.form:
        case "adequate":
            return _adequate(criticism)
        case "missing":
            return f"Missing: {' and '.join(words)}."
        case "ambiguous":
            return _ambiguous(verdict, words)
        case "unexplained":
            if not verdict.depends_on:
                return (
                    "The residual is larger than the noise floor, and depends on no recorded channel: record more "
                    "channels (supply voltage, humidity, time since power-on), or repeat data sets to see whether it "
                    "repeats."
                )
            return (
                f"The residual depends on {verdict.depends_on[0]} in a way that no effect of the catalogue describes."
            )
        case _:
            return f"Too little data for a verdict: {verdict.reason}."


def _on_axes(group: tuple[str, ...], criticism: Criticism) -> str:
    """Return on which axes an effect was found, where it is not on all."""
    axes = criticism.verdict.axes.get(group[0], ())
    all_axes = criticism.data.info.axes
    return f" on {_list(axes)}" if axes and len(axes) < len(all_axes) else ""


def _ambiguous(verdict: Verdict, words: list[str]) -> str:
    if len(words) > 1:
        return f"Missing: {'; and '.join(words)}; this recording cannot distinguish the effects joined by 'or'."
    if not verdict.indistinguishable:
        return f"An effect similar to {words[0]} is missing, but it explains only a part of the residual."
    names = "; ".join(map(_word, verdict.indistinguishable))
    return f"One of these effects is missing, and this recording cannot tell which: {names}."


def _word(effect_id: str) -> str:
    kind = CATALOGUE.get(effect_id)
    return f"{effect_id} ({kind.term})" if kind else effect_id
