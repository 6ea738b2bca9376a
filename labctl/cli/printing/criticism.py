"""Criticisms, improvements and error ladders as text."""

from __future__ import annotations

from math import log10
from typing import TYPE_CHECKING

from labctl.cli.output import console, format_number, print_heading, print_warnings, table
from labctl.cli.printing.joint import print_joint
from labctl.probability_text import probability_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from labctl.answers.calibrations import ImproveResponse
    from labctl.answers.criticism import CriticismResponse, ResidualMap, Suspect
    from labctl.answers.ladder import LadderResponse
    from labctl.answers.noise import StaticRecordJson
    from labctl.answers.verification import VerificationResponse


#: Of the experiments so many are printed, the best; JSON has all.
SHOWN_EXPERIMENTS = 3
#: From dark to bright: residual over floor in the small map.
SHADES = " ·░▒▓█"


def print_verification(answer: VerificationResponse) -> None:
    """Print what a version leaves of a recording as it is, axis by axis."""
    from labctl.services.criticism.verification.text import verification_sentence

    console.print(verification_sentence(answer), soft_wrap=not console.is_terminal)
    rows = table("", "axis", "RMS deg/s", "expected", "limit", "largest", "mean", numbers=5)
    for axis, axis_answer in answer.axes.items():
        figures = (
            axis_answer.rms_dps,
            axis_answer.expected_dps,
            axis_answer.limit_dps,
            axis_answer.max_dps,
            axis_answer.bias_dps,
        )
        rows.add_row(axis, *map(format_number, figures))
    console.print(rows)
    off = f" on axis {', '.join(answer.axes_off)}" if answer.axes_off and len(answer.axes) > 1 else ""
    console.print("as expected" if answer.ok else f"NOT as expected{off}: fit a new version, or criticise this version")


def print_criticism(answer: CriticismResponse) -> None:
    """Print a criticism: the version without refitting, the verdict on its model refitted, the errors, a small
    map, a table."""
    prints_all = not console.is_terminal  # a program that reads lines gets each sentence on one
    _print_applied(answer, whole=prints_all)
    for line in answer.text:
        console.print(line, style="bold" if line is answer.text[0] else None, soft_wrap=prints_all)
    error = answer.error
    of = ", ".join(map(str, answer.recordings or [answer.recording]))
    direct = error["direct_form_rms_dps"]
    residual = (
        "residual" if direct is None else f"residual {format_number(direct)} as applied to the output, compared as"
    )
    console.print(
        f"{answer.serial} version {answer.version}, recording {of}: {residual} "
        f"{format_number(error['rms_dps'])} deg/s RMS, "
        f"held-out {format_number(error['heldout_rms_dps'])}, noise floor {format_number(error['noise_floor_dps'])}",
        style="dim",
    )
    if (static := answer.noise["static"]) is not None:
        _print_static(static)
    for picture in answer.maps:
        _print_map(picture)
    _print_suspects(answer.suspects, whole=prints_all)
    purpose = "to show whether one is missing of" if answer.verdict == "adequate" else "to distinguish"
    for experiment in answer.experiments[:SHOWN_EXPERIMENTS]:
        console.print(
            f"{purpose} {', '.join(experiment['separates'])}: {experiment['do']} ({experiment['hours']:.1f} h, "
            f"{experiment['information_bit']:.2f} of {experiment['open_bit']:.2f} bit expected, one cause named with a "
            f"probability of {probability_text(experiment['power'])})",
        )
    for sentence in _not_testable(answer):
        console.print(sentence, style="dim", soft_wrap=prints_all)
    if answer.next_effect is not None:
        console.print(f"next: labctl improve {answer.serial} --add {answer.next_effect}", style="dim")
    _print_laws(answer)


def _print_suspects(suspects: Sequence[Suspect], *, whole: bool) -> None:
    """Print the suspects with the error of a fit with each, and why one cannot be fitted."""
    if not suspects:
        return
    rows = table("suspects", "effect", "origin", "log BF", "after", "held-out", "alike", numbers=4)
    for suspect in suspects:
        others = [e for e in suspect["alias_group"] if e != suspect["effect"]]
        rows.add_row(
            _name_of(suspect), suspect["origin"], format_number(suspect["log_bayes_factor"], 3),
            format_number(suspect["rms_after_dps"]), format_number(suspect["heldout_rms_after_dps"]),
            ", ".join(others[:3]),
        )  # fmt: skip
    console.print(rows)
    for suspect in suspects:
        if suspect["fit_refused"]:
            text = f"cannot be added: {suspect['effect']}: {suspect['fit_refused']}"
            console.print(text, style="dim", soft_wrap=whole)


def _print_laws(answer: CriticismResponse) -> None:
    """Print the laws that are proposed, what would follow from the likeliest, and the command that takes it."""
    if not answer.laws:
        return
    print_heading("laws, which describe and name no cause")
    for law in answer.laws:
        errors = f"{format_number(law['rms_after_dps'])} deg/s, held-out {format_number(law['heldout_rms_after_dps'])}"
        text = f"{probability_text(law['probability'])}: {'; '.join(law['formulas'])}: {errors}"
        console.print(text, soft_wrap=not console.is_terminal)
    if answer.law_test is not None:
        aim = "to distinguish the first two" if len(answer.laws) > 1 else "to test it"
        console.print(f"{aim}: {answer.law_test['do']}", soft_wrap=not console.is_terminal)
    first = answer.laws[0]
    for sentence in first["follows"]:
        console.print(f"If it is the first: {sentence}", style="dim", soft_wrap=not console.is_terminal)
    words = " ".join(f"--formula '{formula}'" for formula in first["formulas"])
    console.print(f"next: labctl improve {answer.serial} {words}", style="dim", soft_wrap=True)


def _print_applied(answer: CriticismResponse, *, whole: bool) -> None:
    """Print what the version leaves of a recording that it was not fitted to."""
    from labctl.services.criticism.verification.text import verification_sentence

    if answer.applied is None or answer.applied.seen:
        return
    style = None if answer.applied.ok else "red"
    console.print(verification_sentence(answer.applied), style=style, soft_wrap=whole)
    console.print(f"Refitted to recording {answer.recording}:")


def _not_testable(answer: CriticismResponse) -> list[str]:
    """Return what a recording cannot test: effects that its schedule hides, and those that need a missing channel."""
    hidden = [line["effect"] for line in answer.not_testable if line["why"] != "channel"]
    lacking: dict[str, list[str]] = {}
    for line in answer.not_testable:
        if line["why"] == "channel":
            lacking.setdefault(", ".join(map(_channel_in_words, line["needs"])), []).append(line["effect"])
    sentences = [f"effects that this schedule cannot test: {', '.join(hidden)}"] if hidden else []
    return sentences + [
        f"not recorded: {channel}, which would show {', '.join(each)}" for channel, each in lacking.items()
    ]


def _channel_in_words(name: str) -> str:
    """Return the name of a column in words: of turns the table rate is the mean, so it is that at each instant."""
    return "the rate at each instant (table_rate_dps)" if name == "table_rate_dps" else name


def _print_static(static: StaticRecordJson) -> None:
    """Print what the longest section at rest shows."""
    for axis, noise in static["axes"].items():
        figures = (("N", noise["N"]), ("B", noise["B"]), ("K", noise["K"]))
        shown_figures = [(letter, figure) for letter, figure in figures if figure["value"] is not None]
        sentence = ", ".join(
            f"{letter} {format_number(f['value'], 3)} +- {format_number(f['u'], 2)} {f['unit']}"
            for letter, f in shown_figures
        )
        instead = "; B is the value of the data sheet" if noise["replaces_datasheet"] else ""
        text = f"axis {axis} at rest for {static['duration_s']:.0f} s: {sentence or 'no slope shows'}{instead}"
        console.print(text, style="dim")


def _name_of(suspect: Suspect) -> str:
    return suspect["effect"] + ("" if suspect["physical"] else " (not physical)")


def _print_map(picture: ResidualMap, columns: int = 21) -> None:
    """Draw residual over floor, rates across and temperatures down."""
    rates = sorted({round(rate, 2) for rate in picture["table_rate_dps"]})
    temperatures_c = sorted({round(value) for value in picture["temperature_c"]}, reverse=True)
    if len(rates) < 2 or len(temperatures_c) < 2 or len(temperatures_c) > 40:
        return
    cells: dict[tuple[int, int], list[float]] = {}
    step = max(-(-len(rates) // columns), 1)
    for rate, value, score in zip(
        picture["table_rate_dps"], picture["temperature_c"], picture["over_floor"], strict=True
    ):
        cells.setdefault((rates.index(round(rate, 2)) // step, temperatures_c.index(round(value))), []).append(
            abs(score)
        )
    console.print(
        f"residual over floor, axis {picture['axis']}, {picture['position']} up  (' ' < 1, █ >= 5)", style="dim"
    )
    for row, value in enumerate(temperatures_c):
        line = ""
        for column in range(-(-len(rates) // step)):
            scores = cells.get((column, row))
            line += "  " if scores is None else 2 * SHADES[min(int(max(scores)), len(SHADES) - 1)]
        console.print(f"{value:5d} deg C |{line}|", highlight=False)
    console.print(f"            {rates[0]:g} to {rates[-1]:g} deg/s", style="dim")


def print_improvement(answer: ImproveResponse) -> None:
    """Print what a change brought."""
    before = answer.before
    print_warnings(answer.warnings)
    print_heading(answer.serial, f" version {answer.version}, from {answer.parent}: {answer.model.name}")
    print_joint(answer.joint)
    rows = table("", "deg/s", "before", "after", numbers=2)
    rows.add_row("RMS", format_number(before.rms_dps), format_number(answer.error.rms_dps))
    rows.add_row("held-out", format_number(before.heldout_rms_dps), format_number(answer.error.heldout_rms_dps))
    rows.add_row("noise floor", format_number(before.noise_floor_dps), format_number(answer.error.noise_floor_dps))
    console.print(rows)
    if answer.thermal_hint is not None:
        console.print(f"  {answer.thermal_hint['text']}", soft_wrap=True)
    for effect_id, span in answer.plausible.items():
        if not span["inside"]:
            console.print(
                f"  {effect_id}: outside of what is usual ({span['from']:g} to {span['to']:g}); another effect may "
                "explain the same error: criticise the new version",
                style="yellow",
            )
    for entry in answer.left_out:
        size = entry.get("rms_dps")
        cost = "" if size is None else f", so that {size:.2g} deg/s RMS remain uncorrected on these data"
        console.print(
            f"  {entry['effect']} ({entry['origin']}) is not part of a calibration; a calibration file leaves it "
            f"out{cost}",
            soft_wrap=True,
        )
    console.print(f"next: labctl criticise {answer.serial}", style="dim")


def print_ladder(answer: LadderResponse) -> None:
    """Print how the error falls from version to version, as bars."""
    for line in ladder_lines(answer):
        console.print(line, highlight=False, soft_wrap=True)


def ladder_lines(answer: LadderResponse, width: int = 40) -> list[str]:
    """Return the errors as bars on a logarithmic scale, a line per version; `|` marks the noise floor in each."""
    errors = [e for s in answer.steps for e in (s.rms_dps, s.heldout_rms_dps) if e]
    if not errors:
        return [f"{answer.serial}: no version has an error figure"]
    drawn = [*errors, answer.noise_floor_dps or errors[0]]  # readings without scatter leave an error below the floor
    lowest = 0.7 * min(drawn)
    span = log10(max(drawn) / lowest)

    def place(value: float) -> int:
        return max(round(log10(value / lowest) / span * width), 1)

    scale = "error, deg/s, logarithmic (bar: fitted data; o: held-out; |: noise floor)"
    lines = [f"{answer.serial}, versions of recording {answer.recording}: {scale}"]
    for step in answer.steps:
        bar = list(("█" * place(step.rms_dps) if step.rms_dps else "").ljust(width + 2))
        if step.heldout_rms_dps:
            bar[place(step.heldout_rms_dps)] = "o"
        if answer.noise_floor_dps:
            bar[place(answer.noise_floor_dps)] = "|"
        figures = f"{format_number(step.rms_dps)}  held-out {format_number(step.heldout_rms_dps)}"
        lines.append(f"{step.version:3d} {''.join(bar)} {figures}  {step.model}")
    if answer.noise_floor_dps:
        lines.append(f"    noise floor {format_number(answer.noise_floor_dps)} deg/s")
    for other in answer.others:
        error = (
            "cannot be applied" if other.applied_rms_dps is None else f"{format_number(other.applied_rms_dps)} deg/s"
        )
        lines.append(
            f"    version {other.version} of recording {other.recording}, applied to this recording without "
            f"refitting: {error}"
        )
    return lines
