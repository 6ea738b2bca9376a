"""The limits of a recipe's [fit], compared with the figures of a draft."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

from labctl.services.schemas.certification import CertifiedErrors
from labctl.services.schemas.reports.drafts import AppliedDraft, DriftFromVersion, LimitResult
from procedures.recipe.fit_rules import FitLimits

Limit = Literal["heldout_rms_dps", "max_error_dps", "drift_dps"]


def held_against(
    limits: FitLimits, error: CertifiedErrors, as_left: AppliedDraft | None, drift: DriftFromVersion | None
) -> list[LimitResult]:
    """Return each limit with the figure that it is for; a figure that is not known decides nothing."""
    return list(_results(limits, error, as_left, drift))


def _results(
    limits: FitLimits, error: CertifiedErrors, as_left: AppliedDraft | None, drift: DriftFromVersion | None
) -> Iterator[LimitResult]:
    if (most := limits.heldout_rms_dps) is not None:
        why = "" if error.heldout_rms_dps is not None else "no temperature could be left out of the fit"
        yield _result("heldout_rms_dps", None, error.heldout_rms_dps, most, why)
    if (most := limits.max_error_dps) is not None:
        found = None if as_left is None else {axis: one.max_dps for axis, one in as_left.axes.items()}
        yield from _by_axis("max_error_dps", found, most, "the draft cannot be applied to the recording")
    if (most := limits.drift_dps) is not None:
        largest = None if drift is None else drift.largest_dps
        yield from _by_axis("drift_dps", largest, most, "no version was in force, or it cannot be applied")


def _by_axis(limit: Limit, found: dict[str, float] | None, most: float, why: str) -> Iterator[LimitResult]:
    if not found:
        yield _result(limit, None, None, most, why)
        return
    for axis, value in found.items():
        yield _result(limit, axis, value, most, "")


def _result(limit: Limit, axis: str | None, value: float | None, most: float, why: str) -> LimitResult:
    passed = None if value is None else value <= most
    return LimitResult(limit=limit, axis=axis, value_dps=value, at_most_dps=most, passed=passed, why=why)


def all_within(results: Sequence[LimitResult]) -> bool | None:
    """Return whether all limits are kept; None where there are none, or where none is broken but not all are known."""
    passed = [each.passed for each in results]
    if False in passed:
        return False
    return True if passed and None not in passed else None
