"""Intermediate checks of a standard on control charts, one for each nominal."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict

from labctl.answers.standards import ChartLimits, StandardCheckResponse
from labctl.metrology.control_chart import ChartPoint, Judged, Limits, judged
from labctl.services.standards.predictions import prediction_at
from labctl.store import RegisteredStandard, StandardCheck

BASES = {"history": "its history", "stated u": "the stated uncertainties"}


def charted(standard: RegisteredStandard) -> list[tuple[StandardCheck, Judged]]:
    """Return every check of a standard in order of time, judged on the chart of its nominal."""
    charted_checks: list[tuple[StandardCheck, Judged]] = []
    for nominal in dict.fromkeys(check.nominal for check in standard.checks):
        checks = [check for check in standard.checks if check.nominal == nominal]
        charted_checks += zip(checks, judged([_point(standard, check) for check in checks]), strict=True)
    return sorted(charted_checks, key=lambda charted_check: charted_check[0].checked_at)


def _point(standard: RegisteredStandard, check: StandardCheck) -> ChartPoint:
    """Return a check with what the certificates predict for its day; nothing where they state no value."""
    on = check.checked_at.date()
    expected = prediction_at(standard, check.nominal, on) or prediction_at(standard, None, on)
    if expected is None or expected.value is None:
        return ChartPoint(check.value, check.u)
    return ChartPoint(check.value, check.u, expected.value, expected.u)


def to_be_checked(standard: RegisteredStandard) -> Iterator[tuple[StandardCheck, Judged]]:
    """Yield the newest check of each nominal that is out of limits, unless a certificate came after it."""
    newest = {check.nominal: (check, judgement) for check, judgement in charted(standard)}
    last = standard.in_force[-1].calibrated if standard.in_force else None
    for check, judgement in newest.values():
        if judgement.state == "out" and (last is None or check.checked_at.date() >= last):
            yield check, judgement


def check_answer(check: StandardCheck, judgement: Judged) -> StandardCheckResponse:
    """Return a judged check as an answer."""
    return StandardCheckResponse(
        checked_at=check.checked_at, nominal=check.nominal, value=check.value, u=check.u, note=check.note, by=check.by,
        state=judgement.state, limits=[limits_answer(limit) for limit in judgement.limits],
    )  # fmt: skip


def limits_answer(limits: Limits) -> ChartLimits:
    """Return control limits as an answer."""
    return ChartLimits(**asdict(limits), low=limits.low, high=limits.high)


def out_text(value: float, unit_symbol: str, judgement: Judged) -> str:
    """Return by which limits a value is out, in words."""
    values_text = "; ".join(
        f"by {BASES[limit.basis]} {limit.low:.6g} to {limit.high:.6g}"
        for limit in judgement.limits
        if limit.state_of(value) == "out"
    )
    return f"{value:.6g} {unit_symbol} is out of the control limits ({values_text})"
