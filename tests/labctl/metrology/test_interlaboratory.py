"""En number and zeta score: against published figures, and where they are not defined.

The published figures are of the reference manual of NIST Dataplot, ISO 13528 EN SCORE and ISO 13528 ZETA SCORE
(https://www.itl.nist.gov/div898/software/dataplot/refman2/auxillar/enscore.htm and zetascor.htm): scores of the gear
diameters of GEAR.DAT (usnistgov/dataplot, lib/data), assigned value 1. The manual prints three digits, cut off.
"""

from __future__ import annotations

import math
import statistics

import pytest

from labctl.errors import BadInput
from labctl.metrology.interlaboratory import (
    Performance,
    Result,
    en_number,
    en_performance,
    zeta_performance,
    zeta_score,
)

#: GEAR.DAT, thousandths of the unit, ten batches of ten.
GEAR = """
1006 996 998 1000 992 993 1002 999 994 1000 998 1006 1000 1002 997 998 996 1000 1006 988
991 987 997 999 995 994 1000 999 996 996 1005 1002 994 1000 995 994 998 996 1002 996
998 998 982 990 1002 984 996 993 980 996 1009 1013 1009 997 988 1002 995 998 981 996
990 1004 996 1001 998 1000 1018 1010 996 1002 998 1000 1006 1000 1002 996 998 996 1002 1006
1002 998 996 995 996 1004 1004 998 999 991 991 995 984 994 997 997 991 998 1004 997
"""
DIAMETERS = [int(each) / 1000 for each in GEAR.split()]
U_ASSIGNED = statistics.stdev(DIAMETERS)
U_FIRST_BATCH = statistics.stdev(DIAMETERS[:10])
#: Diameter -> zeta score and En number as the manual prints them.
PRINTED = {1.006: (0.785, 0.393), 0.996: (-0.523, -0.262), 0.998: (-0.261, -0.131), 1.000: (0.0, 0.0)}


def cut(value: float, digits: int = 3) -> float:
    return math.trunc(value * 10**digits) / 10**digits


@pytest.mark.parametrize("diameter", PRINTED)
def test_scores_are_those_that_nist_published(diameter: float) -> None:
    zeta, en = PRINTED[diameter]
    laboratory, assigned = Result(diameter, U_FIRST_BATCH), Result(1.0, U_ASSIGNED)
    assert cut(zeta_score(laboratory, assigned)) == pytest.approx(zeta, abs=1e-9)
    assert round(en_number(laboratory, assigned), 3) == pytest.approx(en, abs=1e-9)  # k = 2 on both sides


def test_the_same_coverage_factor_makes_en_that_part_of_zeta() -> None:
    first, second = Result(10.3, 0.1, k=2.5), Result(10.0, 0.2, k=2.5)
    assert en_number(first, second) == pytest.approx(zeta_score(first, second) / 2.5)
    assert zeta_score(first, second) == pytest.approx(0.3 / math.hypot(0.1, 0.2))
    assert en_number(second, first) == -en_number(first, second)


def test_what_both_share_cancels_in_the_difference() -> None:
    # u = 0.5 each, of which 0.4 is one error of one standard: 0.3 each is left
    first, second = Result(10.0, 0.5), Result(11.0, 0.5)
    assert zeta_score(first, second) == pytest.approx(-1.0 / math.hypot(0.5, 0.5))
    assert zeta_score(first, second, covariance=0.16) == pytest.approx(-1.0 / math.hypot(0.3, 0.3))
    assert en_number(first, second, covariance=0.16) == pytest.approx(-0.5 / math.hypot(0.3, 0.3))


def test_results_without_an_independent_part_cannot_be_compared() -> None:
    with pytest.raises(BadInput, match="nothing is left in which the results are independent"):
        zeta_score(Result(1.0, 0.5), Result(1.0, 0.5), covariance=0.25)
    with pytest.raises(BadInput, match="two finite numbers"):
        en_number(Result(1.0, float("nan")), Result(1.0, 0.5))


@pytest.mark.parametrize(
    ("zeta", "said"), [(2.0, "satisfactory"), (-2.01, "questionable"), (2.99, "questionable"), (-3.0, "unsatisfactory")]
)
def test_limits_of_zeta(zeta: float, said: Performance) -> None:
    assert zeta_performance(zeta) == said


@pytest.mark.parametrize(("en", "said"), [(1.0, "satisfactory"), (-1.0, "satisfactory"), (1.001, "unsatisfactory")])
def test_limits_of_en(en: float, said: Performance) -> None:
    assert en_performance(en) == said
