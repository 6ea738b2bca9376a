"""Figures in words: the pages round a value to its uncertainty as every other output does."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from tests.helpers.rounding_cases import CASES

if TYPE_CHECKING:
    from playwright.sync_api import Page


def test_pages_round_as_the_command_line_does(visit: Callable[..., Page]) -> None:
    page = visit("/")
    found = page.evaluate(
        """async cases => {
          const { roundedToUncertainty } = await import("/static/js/core/rounding.js");
          return cases.map(([value, u]) => roundedToUncertainty(value, u));
        }""",
        [[value, None if u is None or not np.isfinite(u) else u] for value, u, _ in CASES],
    )
    assert [(each["value"], each["u"], each["exponent"]) for each in found] == [shown for *_, shown in CASES]
