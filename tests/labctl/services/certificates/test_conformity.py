"""Statements of conformity: simple acceptance and a guard band as wide as U, at the limit and on both sides of it."""

from __future__ import annotations

import pytest

from labctl.certificates.document import AxisError, ResultPoint, StateOfItem
from labctl.services.certificates.conformity import NoAcceptance, conformity
from labctl.services.schemas.documents.certificates import OrderedConformity


def state(*largest_dps: float) -> StateOfItem:
    axes = tuple(AxisError(axis="xyz"[i], rms_dps=0.0, max_dps=value) for i, value in enumerate(largest_dps))
    return StateOfItem(basis="version 1", datasets=5, axes=axes)


def point(expanded_dps: float) -> ResultPoint:
    return ResultPoint(axis="z", temperature_c=20.0, rate_dps=1.0, error_dps=0.0, expanded_dps=expanded_dps, k=2.0)


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
    ordered = OrderedConformity.model_validate({"specification": "S", "limit_dps": 1.0, "rule": rule})
    found = conformity(ordered, state(0.1, error_dps), (point(0.125), point(0.25)))
    assert found.passed is passes
    assert found.statement.startswith("PASS" if passes else "FAIL")
    assert found.acceptance_dps == (1.0 if rule == "simple" else 0.75)
    assert ("guard band w = U" in found.statement) is (rule == "guard-band")
    assert "ILAC-G8" in found.statement


def test_a_guard_band_as_wide_as_the_limit_is_refused() -> None:
    ordered = OrderedConformity(specification="S", limit_dps=0.25, rule="guard-band")
    with pytest.raises(NoAcceptance, match=r"U = 0.25 deg/s, is not smaller than the limit, 0.25 deg/s"):
        conformity(ordered, state(0.0), (point(0.25),))
