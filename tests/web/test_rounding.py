"""Figures in words: the pages round a value to its uncertainty as every other output does."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from tests.helpers.browser import MINUS
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
    # the pages have the typographic minus sign in place of the hyphen
    assert [(each["value"], each["u"], each["exponent"]) for each in found] == [
        (value.replace("-", MINUS), u, exponent) for *_, (value, u, exponent) in CASES
    ]
