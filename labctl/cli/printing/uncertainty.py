"""An uncertainty budget as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from labctl.cli.output import console, format_number, stderr, table

if TYPE_CHECKING:
    from labctl.services.schemas.uncertainty import BudgetLineResponse, BudgetResponse, UncertaintyResponse

#: Lines that are evaluated from the recording; the others are standards, whose names say what they are.
EVALUATED = frozenset({"coefficients", "model", "repeatability"})


def print_uncertainty(answer: UncertaintyResponse) -> None:
    """Print the budget of each axis, its coefficients, and what is not stated."""
    where = f"{answer.rate_dps:g} deg/s, {answer.temperature_c:g} deg C"
    for axis, budget in answer.budget.items():
        _print_lines(f"{answer.serial} version {answer.version}, axis {axis}, corrected rate at {where}", budget)
    _print_coefficients(answer)
    if not answer.inside:
        console.print("this rate or temperature was not calibrated: the figures are extrapolated", style="yellow")
    if answer.not_stated:
        console.print(
            f"uncertainties that the bench does not state, and that U does not contain: {', '.join(answer.not_stated)}",
            style="yellow",
            markup=False,
        )
    if answer.overdue:
        late = {line.name: line.due for one in answer.budget.values() for line in one.lines if line.overdue}
        for name, due in late.items():
            stderr.print(f"standard {name} was past its due date {due}; have it calibrated", style="bold red")


def _print_lines(title: str, budget: BudgetResponse) -> None:
    rows = table(title, "source", "type", "distribution", "u", "unit", "c", "|c| u, deg/s", "freedom", numbers=1)
    for line in budget.lines:
        freedom = "inf" if line.degrees_of_freedom is None else format_number(line.degrees_of_freedom, 3)
        rows.add_row(
            f"{line.source} ({line.name})" if line.source in EVALUATED else line.name, line.type, line.distribution,
            format_number(line.u, 3), line.unit, format_number(line.sensitivity, 3), _contribution(line), freedom,
        )  # fmt: skip
    console.print(rows)
    effective = budget.effective_degrees_of_freedom
    console.print(
        f"u_c = {format_number(budget.combined, 2)} deg/s, effective degrees of freedom "
        f"{'inf' if effective is None else format_number(effective, 3)}, k = {format_number(budget.k, 3)}, "
        f"U = {format_number(budget.expanded, 2)} deg/s (95.45 %)",
        markup=False,
    )
    for line in budget.lines:
        if line.contribution is None and line.stated:
            console.print(f"{line.source} is unknown: {line.why}", style="yellow", markup=False)


def _contribution(line: BudgetLineResponse) -> str:
    return "not stated" if not line.stated else format_number(line.contribution, 2)


def _print_coefficients(answer: UncertaintyResponse) -> None:
    rows = table(
        f"coefficients at {answer.temperature_c:g} deg C",
        "coefficient", "unit", "value", "u_c", "k", "U", "from standards", numbers=5,
    )  # fmt: skip
    for axis, named in answer.coefficients.items():
        for name, one in named.items():
            parts = [line.contribution for line in one.lines if line.source not in EVALUATED]
            known = [part for part in parts if part is not None]
            standards = sum(part**2 for part in known) ** 0.5 if known else None
            rows.add_row(
                f"{axis} {name}", one.unit, format_number(one.value), format_number(one.combined, 2),
                format_number(one.k, 3), format_number(one.expanded, 2), format_number(standards, 2),
            )  # fmt: skip
    console.print(rows)
