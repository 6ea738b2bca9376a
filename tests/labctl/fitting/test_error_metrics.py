"""Which of several errors is the smallest, as far as that can be said of root mean squares of few errors."""

from __future__ import annotations

import math

import pytest

from labctl.fitting.estimation.error_metrics import first_of_smallest


@pytest.mark.parametrize(
    ("errors_dps", "n", "first"),
    [
        ([0.002818, 0.002805], 630, 0),  # half a percent apart, known to 2.8 % each
        ([0.0031, 0.002805], 630, 1),
        ([0.002818, 0.002805], 2_000_000, 1),
        ([0.002818, 0.002805], 0, 1),
        ([math.inf, 0.1, 0.2], 10, 1),
        ([math.inf, math.inf], 10, 0),
    ],
)
def test_errors_that_do_not_differ_clearly_are_not_ranked(errors_dps: list[float], n: int, first: int) -> None:
    assert first_of_smallest(errors_dps, n) == first
