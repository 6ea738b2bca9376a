"""A probability in words: one rounding on pages, in commands and sentences. Certificates give a risk to two digits."""

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
