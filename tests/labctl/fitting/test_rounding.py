"""A result is rounded to two significant digits of its uncertainty (GUM 7.2.6)."""

from __future__ import annotations

import pytest

from labctl.fitting.numeric.rounding import rounded_to_uncertainty
from tests.helpers.rounding_cases import CASES


@pytest.mark.parametrize(("value", "u", "shown"), CASES)
def test_value_and_uncertainty_have_the_same_place(
    value: float, u: float | None, shown: tuple[str, str | None, int]
) -> None:
    found = rounded_to_uncertainty(value, u)
    assert (found.value, found.u, found.exponent) == shown


def test_no_known_uncertainty_is_ever_shown_as_zero() -> None:
    for exponent in range(-15, 9):
        found = rounded_to_uncertainty(1.0, 3.456 * 10.0**exponent)
        if found.u is not None and exponent >= -10:
            assert float(found.u) == pytest.approx(3.5 * 10.0**exponent / 10.0**found.exponent, rel=0.05)
