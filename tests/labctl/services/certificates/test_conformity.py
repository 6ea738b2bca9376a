"""Statements of conformity: the rule, at the limit and beside it; the use; and no statement over unknown U."""

from __future__ import annotations

from functools import partial
from typing import Any

import pytest

from labctl.answers.certificates import OrderedConformity
from labctl.certificates.document import AnyAxisResult, ResultPoint
from labctl.fitting.uncertainty.budget import Budget, BudgetLine
from labctl.services.certificates.conformity import NoAcceptance, NoDecision, conformity, specific_risk
from labctl.services.certificates.evidence import Errors, VerifiedError

OWN = {"specification": "S", "about": "own axis"}


decided = partial(conformity, widening=1.0)


def fitted(*largest_dps: float) -> Errors:
    return Errors(max(largest_dps), 5)


def verified(
    *errors_dps: float, expanded_dps: float | None = 0.2, fitted_dps: float = 0.05, is_anew: bool = True
) -> Errors:
    k = None if expanded_dps is None else 2.0
    unknown = BudgetLine("repeatability", "", "A", "normal", None, "deg/s", 1.0, None, why="one power-on only")
    why = () if k else (unknown,)
    budget = Budget("corrected_rate", "deg/s", None, why, None if k is None else 0.1, None, k, expanded_dps)
    places = [(0.0, 0.0, 40.0 * i - 40.0) for i in range(len(errors_dps))]
    found = tuple(VerifiedError("z", place, 20.0, e, budget) for place, e in zip(places, errors_dps, strict=True))
    return Errors(fitted_dps, 5, found, len(errors_dps), is_anew=is_anew)


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
    found = decided(ordered, fitted(0.1, error_dps), (point(0.125), point(0.25)), (), ())
    assert found.passed is passes
    assert found.statement.startswith("PASS" if passes else "FAIL")
    assert found.acceptance_dps == (1.0 if rule == "simple" else 0.75)
    assert ("guard band w = 1 U" in found.statement) is (rule == "guard-band")
    assert "ILAC-G8" in found.statement
    assert "over the 5 data sets that the calibration was fitted to" in found.statement


def test_a_guard_band_as_wide_as_the_limit_is_refused() -> None:
    ordered = OrderedConformity.model_validate({**OWN, "limit_dps": 0.25, "rule": "guard-band"})
    with pytest.raises(NoAcceptance, match=r"the guard band, 0.25 deg/s, is not smaller than the limit, 0.25 deg/s"):
        decided(ordered, fitted(0.0), (point(0.25),), (), ())


def test_where_the_item_turns_about_any_axis_u_is_that_of_the_rate_vector() -> None:
    ordered = OrderedConformity(specification="S", limit_dps=1.0, rule="guard-band")
    found = decided(ordered, fitted(0.3, 0.1), (point(0.1),), (about_any("x", 0.5), about_any("y", 0.6)), ())
    assert (found.passed, found.expanded_dps, found.acceptance_dps) == (True, 0.6, 0.4)
    assert "turned about any axis of its case at up to 100 °/s and 20.0 to 20.0 °C" in found.statement
    assert not decided(ordered, fitted(0.3, 0.1), (point(0.1),), (about_any("x", 0.71),), ()).passed


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
        decided(ordered, fitted(0.0), (point(0.1),), given["any_axis"], given["left_out"])


def test_what_was_verified_is_decided_place_by_place_and_named_as_unseen() -> None:
    ordered = OrderedConformity.model_validate({**OWN, "limit_dps": 1.0, "rule": "guard-band"})
    found = decided(ordered, verified(0.1, -0.79, 0.3), (point(0.15),), (), ())
    assert (found.passed, found.evidence, found.datasets, found.expanded_dps) == (True, "verification", 3, 0.2)
    assert [each.passed for each in found.results] == [True, True, True]
    assert "over 3 data sets that were measured to verify, at -40 to 40 °/s and 20.0 to 20.0 °C" in found.statement
    assert (
        "mounted and switched on anew, and that the calibration was not fitted to (0.79 °/s), and over the 5 that "
        in (found.statement)
    )
    assert f"the limit is {100 * found.results[1].risk:.2g} % (JCGM 106:2012" in found.statement
    failed = decided(ordered, verified(0.1, -0.81, 0.3), (point(0.15),), (), ())
    assert (failed.passed, [each.passed for each in failed.results]) == (False, [True, False, True])


def test_a_place_within_its_own_u_does_not_pass_the_range_by_itself() -> None:
    """The statement holds for all of the range, where U is larger than at the places that were verified."""
    ordered = OrderedConformity.model_validate({**OWN, "limit_dps": 1.0, "rule": "guard-band"})
    found = decided(ordered, verified(0.75), (point(0.3),), (), ())
    assert (found.passed, found.results[0].passed, found.acceptance_dps) == (False, True, 0.7)


def test_nothing_is_decided_where_u_is_not_known_at_a_place_that_was_verified() -> None:
    ordered = OrderedConformity.model_validate({**OWN, "limit_dps": 1.0, "rule": "simple"})
    with pytest.raises(
        NoDecision, match=r"not known at 0, 0, -40 deg/s about x, y, z, .* \(repeatability: one power-on"
    ):
        decided(ordered, verified(0.1, expanded_dps=None), (point(0.1),), (), ())


@pytest.mark.parametrize(
    ("error_dps", "u_dps", "risk"),
    [
        (0.0, 0.5, 2 * 0.022750),
        (0.5, 0.25, 0.022750),
        (1.0, 0.1, 0.5),
        (-1.0, 0.1, 0.5),
        (0.3, 0.0, 0.0),
        (1.2, 0.0, 1.0),
    ],
)
def test_the_specific_risk_is_that_of_the_normal_distribution(error_dps: float, u_dps: float, risk: float) -> None:
    assert specific_risk(error_dps, u_dps, 1.0) == pytest.approx(risk, rel=1e-4)


def test_the_guard_band_covers_the_largest_of_all_errors() -> None:
    ordered = OrderedConformity.model_validate({**OWN, "limit_dps": 1.0, "rule": "guard-band"})
    found = conformity(ordered, fitted(0.6), (point(0.25),), (), (), 1.5)
    assert (found.passed, found.guard_band_dps, found.acceptance_dps, found.expanded_dps) == (True, 0.375, 0.625, 0.25)
    assert "guard band w = 1.5 U, which covers the largest of all errors" in found.statement
    simple = OrderedConformity.model_validate({**OWN, "limit_dps": 1.0, "rule": "simple"})
    assert conformity(simple, fitted(0.6), (point(0.25),), (), (), 1.5).guard_band_dps == 0.0


def test_errors_that_the_fit_has_seen_count_too() -> None:
    """A few data sets that happen to be good do not make an item conform whose fitted data sets do not."""
    ordered = OrderedConformity.model_validate({**OWN, "limit_dps": 1.0, "rule": "guard-band"})
    found = decided(ordered, verified(0.1, -0.2, 0.3, fitted_dps=0.9), (point(0.15),), (), ())
    assert (found.passed, found.largest_error_dps) == (False, 0.9)
    shared = decided(ordered, verified(0.1, -0.2, 0.3, is_anew=False), (point(0.15),), (), ())
    assert "in a mounting or a powered session of the others" in shared.statement


def test_simple_acceptance_is_refused_where_u_reaches_the_limit() -> None:
    ordered = OrderedConformity(specification="S", limit_dps=1.0, rule="simple")
    with pytest.raises(NoAcceptance, match=r"U = 1.2 deg/s is not smaller than the limit.*order about = .own axis"):
        decided(ordered, fitted(0.1), (point(0.1),), (about_any("x", 1.2),), ())


def test_nothing_is_decided_where_the_largest_error_has_no_bound() -> None:
    ordered = OrderedConformity.model_validate({**OWN, "limit_dps": 1.0, "rule": "guard-band"})
    with pytest.raises(NoDecision, match="the largest error has no bound"):
        conformity(ordered, fitted(0.1), (point(0.1),), (), (), float("nan"))
