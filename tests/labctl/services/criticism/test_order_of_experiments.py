"""What decides per hour comes before what only moves the probabilities; information leads where nothing decides."""

from __future__ import annotations

from typing import Any, cast

import pytest

from labctl.fitting.criticism import Forecast
from labctl.services.criticism.next_experiment import SET_UP_H, Foreseen


def foreseen(bit: float, names_one: float, hours: float, *, wrong: float = 0.0, person_h: float = 0.0) -> Foreseen:
    nothing = cast("Any", None)
    return Foreseen(nothing, nothing, "", Forecast(bit, 0.0, names_one, wrong, ()), hours, person_h, 0)


def test_an_experiment_that_decides_comes_before_one_with_more_information_per_hour() -> None:
    moves, decides = foreseen(0.27, 0.0, 0.5), foreseen(0.28, 1.0, 0.6)
    assert moves.bit_per_h > decides.bit_per_h
    assert decides.rank > moves.rank


def test_of_two_that_decide_the_one_that_decides_more_per_hour_is_first() -> None:
    long, short = foreseen(1.0, 1.0, 9.75), foreseen(0.5, 0.3, 0.75)
    assert (long.rank[0], short.rank[0]) == pytest.approx((0.1, 0.3))
    assert foreseen(0.5, 0.3, 0.75, person_h=1.0).rank[0] == pytest.approx(0.15)
    assert foreseen(0.5, 0.3, 0.75, wrong=0.2).rank[0] == pytest.approx(0.1)


def test_where_none_is_expected_to_decide_information_per_hour_orders_them() -> None:
    one, other = foreseen(0.4, 0.04, 1.0 - SET_UP_H), foreseen(0.3, 0.0, 1.0 - SET_UP_H)
    assert (one.rank, other.rank) == ((0.0, 0.4), (0.0, 0.3))
    assert foreseen(1.0, 0.1, 1.0, wrong=0.1).rank[0] == 0.0
