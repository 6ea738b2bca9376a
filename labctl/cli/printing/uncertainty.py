"""An uncertainty budget as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from labctl.cli.output import console, format_number, stderr, table
from labctl.fitting.numeric.rounding import rounded_to_uncertainty
from labctl.shown_unit import shown_unit

if TYPE_CHECKING:
    from collections.abc import Mapping

    from labctl.answers.budget import BudgetJson, BudgetLineJson
    from labctl.answers.certification import AnyAxisUncertainty
from labctl.answers.uncertainty import (
    UncertaintyResponse,
    VectorUncertainty,
)

#: Lines that are evaluated from the recording; the others are standards, whose names say what they are.
EVALUATED = frozenset({"coefficients", "model", "repeatability", "cross_rates"})


def print_uncertainty(answer: UncertaintyResponse) -> None:
    """Print the budget of each axis, its coefficients, and what is not stated."""
    rate = f"{answer.rate_dps:g} deg/s about this axis alone"
    if answer.vector is not None:
        rate = ", ".join(f"{axis} {value:g}" for axis, value in answer.vector.rates_dps.items()) + " deg/s"
    where = f"{rate}, {answer.temperature_c:g} deg C"
    for axis, budget in answer.budget.items():
        _print_lines(f"{answer.serial} version {answer.version}, axis {axis}, corrected rate at {where}", budget)
    if answer.vector is not None:
        _print_covariance(answer.vector)
    _print_coefficients(answer)
    _print_any_axis(answer.any_axis)
    if not answer.inside:
        console.print("this rate or temperature was not calibrated: the figures are extrapolated", style="yellow")
    if answer.not_stated:
        console.print(
            f"uncertainties that are not stated, and that U does not contain: {', '.join(answer.not_stated)}. "
            f"{answer.not_stated_remedy}".rstrip(),
            style="yellow",
        )
    if answer.overdue:
        late = {line["name"]: line["due"] for one in answer.budget.values() for line in one["lines"] if line["overdue"]}
        for name, due in late.items():
            stderr.print(f"standard {name} was past its due date {due}; have it calibrated", style="bold red")


def _print_lines(title: str, budget: BudgetJson) -> None:
    rows = table(title, "source", "type", "distribution", "u", "unit", "c", "|c| u, deg/s", "freedom", numbers=1)
    for line in budget["lines"]:
        freedom = "inf" if line["degrees_of_freedom"] is None else format_number(line["degrees_of_freedom"], 3)
        rows.add_row(
            f"{line['source']} ({line['name']})" if line["source"] in EVALUATED else line["name"], line["type"],
            line["distribution"], format_number(line["u"], 3), line["unit"], format_number(line["sensitivity"], 3),
            _contribution(line), freedom,
        )  # fmt: skip
    console.print(rows)
    effective = budget["effective_degrees_of_freedom"]
    console.print(
        f"u_c = {format_number(budget['combined'], 2)} deg/s, effective degrees of freedom "
        f"{'inf' if effective is None else format_number(effective, 3)}, k = {format_number(budget['k'], 3)}, "
        f"U = {format_number(budget['expanded'], 2)} deg/s (95.45 %)",
    )
    for line in budget["lines"]:
        if line["contribution"] is None and line["stated"]:
            console.print(f"{line['source']} is unknown: {line['why']}", style="yellow")


def _print_covariance(vector: VectorUncertainty) -> None:
    rows = table(
        "corrected rate vector: covariance, (deg/s)^2, and U, deg/s",
        "output", *vector.outputs, "U, frame of the case", "U, up to a rotation of the frame",
        numbers=len(vector.outputs) + 2,
    )  # fmt: skip
    for axis, row in zip(vector.outputs, vector.covariance_dps2, strict=True):
        rows.add_row(
            axis, *(format_number(value, 2) for value in row), format_number(vector.expanded_dps[axis], 2),
            format_number(vector.aligned_expanded_dps[axis], 2),
        )  # fmt: skip
    console.print(rows)


def _print_any_axis(any_axis: Mapping[str, AnyAxisUncertainty]) -> None:
    if not any_axis:
        return
    reach = next(iter(any_axis.values())).reach_dps
    rows = table(
        f"largest U of a corrected rate, turned about any axis up to {reach:g} deg/s",
        "output", "U, frame of the case", "U, up to a rotation of the frame", "per deg/s across", numbers=3,
    )  # fmt: skip
    for axis, one in any_axis.items():
        across = "" if one.cross_rates is None else format_number(one.cross_rates["per_dps"], 3)
        rows.add_row(axis, format_number(one.bound_dps, 2), format_number(one.aligned_bound_dps, 2), across)
    console.print(rows)
    reasons = [
        text for one in any_axis.values() for text in (one.why, one.cross_rates["why"] if one.cross_rates else "")
    ]
    for text in dict.fromkeys(reasons):
        if text:
            console.print(f"unknown about any axis: {text}", style="yellow")


def _contribution(line: BudgetLineJson) -> str:
    return "not stated" if not line["stated"] else format_number(line["contribution"], 2)


def _print_coefficients(answer: UncertaintyResponse) -> None:
    rows = table(
        f"coefficients at {answer.temperature_c:g} deg C",
        "coefficient", "unit", "value", "u_c", "k", "U", "from standards", numbers=5,
    )  # fmt: skip
    for axis, named in answer.coefficients.items():
        for name, one in named.items():
            parts = [line["contribution"] for line in one["lines"] if line["source"] not in EVALUATED]
            known = [part for part in parts if part is not None]
            standards = sum(part**2 for part in known) ** 0.5 if known else None
            shown = shown_unit(one["unit"], name)
            figures = [
                "–" if each is None else shown.number(each) for each in (one["combined"], one["expanded"], standards)
            ]
            value = rounded_to_uncertainty(shown.factor * (one["value"] or 0.0), shown.scaled(one["expanded"]))
            rows.add_row(
                f"{axis} {name}", shown.unit, "–" if one["value"] is None else value.value + value.power,
                figures[0], format_number(one["k"], 3), figures[1], figures[2],
            )  # fmt: skip
    console.print(rows)
