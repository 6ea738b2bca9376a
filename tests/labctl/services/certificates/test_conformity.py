"""Statements of conformity: the rule, at the limit and beside it; the use; and no statement over unknown U."""

from __future__ import annotations

from typing import Any

import pytest

from labctl.certificates.document import AnyAxisResult, AxisError, ResultPoint, StateOfItem
from labctl.services.certificates.conformity import NoAcceptance, NoDecision, conformity
from labctl.services.schemas.documents.certificates import OrderedConformity

OWN = {"specification": "S", "about": "own axis"}


def state(*largest_dps: float) -> StateOfItem:
    axes = tuple(AxisError(axis="xyz"[i], rms_dps=0.0, max_dps=value) for i, value in enumerate(largest_dps))
    return StateOfItem(basis="version 1", datasets=5, axes=axes)


def point(expanded_dps: float) -> ResultPoint:
    return ResultPoint(axis="z", temperature_c=20.0, rate_dps=1.0, error_dps=0.0, expanded_dps=expanded_dps, k=2.0)


def about_any(output: str, expanded_dps: float | None, why: str = "") -> AnyAxisResult:
    aligned = None if expanded_dps is None else 0.7 * expanded_dps
    return AnyAxisResult(
        output=output, reach_dps=100.0, expanded_dps=expanded_dps, aligned_expanded_dps=aligned, why=why
    )


@pytest.mark.parametrize(
    ("rule", "error_dps", "passes"),
    [
        ("simple", 1.0, True),
        ("simple", 1.0001, False),
        ("guard-band", 0.75, True),
        ("guard-band", 0.7501, False),
    ],
)
def test_the_acceptance_limit_is_that_of_the_rule(rule: str, error_dps: float, passes: bool) -> None:
    ordered = OrderedConformity.model_validate({**OWN, "limit_dps": 1.0, "rule": rule})
    found = conformity(ordered, state(0.1, error_dps), (point(0.125), point(0.25)), (), ())
    assert found.passed is passes
    assert found.statement.startswith("PASS" if passes else "FAIL")
    assert found.acceptance_dps == (1.0 if rule == "simple" else 0.75)
    assert ("guard band w = U" in found.statement) is (rule == "guard-band")
    assert "ILAC-G8" in found.statement
    assert "over the data sets that the calibration was fitted to" in found.statement


def test_a_guard_band_as_wide_as_the_limit_is_refused() -> None:
    ordered = OrderedConformity.model_validate({**OWN, "limit_dps": 0.25, "rule": "guard-band"})
    with pytest.raises(NoAcceptance, match=r"U = 0.25 deg/s, is not smaller than the limit, 0.25 deg/s"):
        conformity(ordered, state(0.0), (point(0.25),), (), ())


def test_where_the_item_turns_about_any_axis_u_is_that_of_the_rate_vector() -> None:
    ordered = OrderedConformity(specification="S", limit_dps=1.0, rule="guard-band")
    found = conformity(ordered, state(0.3, 0.1), (point(0.1),), (about_any("x", 0.5), about_any("y", 0.6)), ())
    assert (found.passed, found.expanded_dps, found.acceptance_dps) == (True, 0.6, 0.4)
    assert "turned about any axis of its case at up to 100 °/s and 20.0 to 20.0 °C" in found.statement
    assert not conformity(ordered, state(0.3, 0.1), (point(0.1),), (about_any("x", 0.71),), ()).passed


@pytest.mark.parametrize(
    ("about", "changed", "why"),
    [
        ("any axis", {"any_axis": (about_any("z", None, "not turned about x"),)}, "not turned about x"),
        ("any axis", {"any_axis": ()}, "older version"),
        ("any axis", {"left_out": ("At 6 places no result is stated.",)}, "At 6 places no result is stated"),
        ("own axis", {"left_out": ("At 6 places no result is stated.",)}, "At 6 places no result is stated"),
    ],
)
def test_nothing_is_decided_where_u_is_not_known(about: str, changed: dict[str, Any], why: str) -> None:
    ordered = OrderedConformity.model_validate(
        {"specification": "S", "limit_dps": 1.0, "about": about, "rule": "simple"}
    )
    given: dict[str, Any] = {"any_axis": (about_any("z", 0.1),), "left_out": (), **changed}
    with pytest.raises(NoDecision, match=why):
        conformity(ordered, state(0.0), (point(0.1),), given["any_axis"], given["left_out"])
