"""Readings that are missing where this computer stood still are its own; what is missing elsewhere is the unit's."""

from __future__ import annotations

import numpy as np
import pytest

from procedures.execution.unit_faults import explained
from procedures.monitoring.bench_snapshot import Gap, ReadingCounts
from procedures.monitoring.host_stalls import Stall

RATE_HZ = 100.0
STALL = Stall(10.0, 10.4, 0.3)


@pytest.mark.parametrize(
    ("gaps", "readings"),
    [
        ([Gap(10.05, 10.35, 30)], 30),
        ([Gap(10.05, 10.35, 20)], 20),
        ([Gap(11.0, 11.4, 40)], 0),  # elsewhere in the same data set
        ([Gap(10.3, 10.7, 40)], 10),  # only the part in the stall
        ([Gap(10.0, 10.6, 60)], 30),  # no more than the unit sends in its length
        ([Gap(10.0, 10.2, 20), Gap(10.2, 10.4, 20)], 30),  # one stall explains its length once
        ([Gap(9.0, 12.0, 20), Gap(10.0, 10.3, 30)], 30),
    ],
)
def test_a_stall_explains_what_is_missing_in_it(gaps: list[Gap], readings: int) -> None:
    assert explained(gaps, [STALL], RATE_HZ) == pytest.approx(readings)


def test_several_stalls_explain_one_long_gap_together() -> None:
    stalls = [STALL, Stall(11.0, 11.3, 0.2)]
    assert explained([Gap(9.9, 11.5, 100)], stalls, RATE_HZ) == pytest.approx(50)


def test_gaps_are_where_the_times_show_them_and_the_rest_is_anywhere_in_the_block() -> None:
    count = ReadingCounts(1000.0)
    count.note(np.array([0.99]), 0.0)
    t_s = np.array([1.0, 1.01, 1.07, 1.08, 1.12])  # 5 are missing, then 3
    count.locate(t_s, 0.0, 10, 0.01)
    assert count.gaps == [Gap(1.01, 1.07, 5), Gap(1.08, 1.12, 3), Gap(0.99, 1.12, 2)]


def test_a_gap_from_the_block_before_is_located() -> None:
    count = ReadingCounts(1000.0)
    count.note(np.array([0.5]), 0.0)
    count.locate(np.array([1.0, 1.01]), 0.0, 49, 0.01)
    assert count.gaps == [Gap(0.5, 1.0, 49)]
