"""Probabilities, odds and shares: one rounding on pages, in commands and sentences; risks on certificates."""

from __future__ import annotations

import math

#: Probabilities beyond these are written as bounds: what was computed is neither impossible nor certain.
MIN_STATED, MAX_STATED = 0.005, 0.995
#: Odds from so many decades on are written as a power of ten.
MAX_DECADES = 6.0
#: Odds of more decades are written as a bound: a larger number would say how far the noise is believed to be Gaussian.
MAX_STATED_DECADES = 100.0
#: A risk of a wrong decision beyond these is written as a bound.
MIN_RISK, MAX_RISK = 1e-4, 0.99


def probability_text(probability: float) -> str:
    """Write a probability in whole percent: 25 %, < 1 %, > 99 %; never 0 % and never 100 %.

    `probabilityText` in `core/format.js` of the pages does the same; `tests/pages/probabilities.json` holds both.
    """
    if probability < MIN_STATED:
        return "< 1 %"
    return f"{math.floor(100.0 * probability + 0.5)} %" if probability < MAX_STATED else "> 99 %"


def odds_text(nats: float) -> str:
    """Write the odds for an effect as people say them: 1300 to 1; `nats` is the natural logarithm of the Bayes factor.

    Beyond 10^100 only the bound is stated: more than 10^100 to 1, or 1 to more than 10^100.
    `oddsText` in `core/format.js` of the pages does the same, with raised digits; `tests/pages/odds.json` holds both.
    """
    decades = abs(nats) / math.log(10.0)
    if decades > MAX_STATED_DECADES:
        odds = f"more than 10^{MAX_STATED_DECADES:.0f}"
    elif decades >= MAX_DECADES:
        odds = f"10^{math.floor(decades + 0.5)}"
    else:
        odds = f"{float(f'{10.0**decades:.2g}'):.7g}"
    return f"{odds} to 1" if nats >= 0.0 else f"1 to {odds}"


def risk_text(risk: float) -> str:
    """Write the risk of a wrong decision on conformity (JCGM 106:2012) to two digits of percent: 0.12 %.

    A limit is set for it, such as 2.5 %, so whole percent would not show on which side of the limit it is.
    """
    if risk < MIN_RISK:
        return f"below {100.0 * MIN_RISK:g} %"
    return f"{100.0 * risk:.2g} %" if risk < MAX_RISK else f"above {100.0 * MAX_RISK:g} %"


def share_text(share: float) -> str:
    """Write a share in whole percent: 0 % is nothing and 100 % is all; a little more or less is "< 1 %" or "> 99 %".

    `percent` in `core/format.js` of the pages does the same; `tests/pages/shares.json` holds both.
    """
    if 0.0 < share < 1.0:
        return probability_text(share)
    return f"{math.floor(100.0 * share + 0.5)} %"
