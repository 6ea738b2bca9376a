"""Probabilities and shares: one rounding on pages, in commands and sentences. A certificate's risk has 2 digits."""

from __future__ import annotations

import math

#: Probabilities beyond these are written as bounds: what was computed is neither impossible nor certain.
MIN_STATED, MAX_STATED = 0.005, 0.995


def probability_text(probability: float) -> str:
    """Write a probability in whole percent: 25 %, < 1 %, > 99 %; never 0 % and never 100 %.

    `probabilityText` in `core/format.js` of the pages does the same; `tests/pages/probabilities.json` holds both.
    """
    if probability < MIN_STATED:
        return "< 1 %"
    return f"{math.floor(100.0 * probability + 0.5)} %" if probability < MAX_STATED else "> 99 %"


def share_text(share: float) -> str:
    """Write a share in whole percent: 0 % is nothing and 100 % is all; a little more or less is "< 1 %" or "> 99 %".

    `percent` in `core/format.js` of the pages does the same; `tests/pages/shares.json` holds both.
    """
    if 0.0 < share < 1.0:
        return probability_text(share)
    return f"{math.floor(100.0 * share + 0.5)} %"
