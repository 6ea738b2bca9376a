"""The study of a delay behind half of a reply: a few of its campaigns."""

from __future__ import annotations

import pytest

from studies import course_time


@pytest.mark.slow
def test_errors_of_half_a_reply_are_inside_u_and_far_outside_the_fit_alone() -> None:
    ends = [course_time.found(seed, instant) for seed, instant in ((1, -1.0), (2, 1.0), (3, -1.0))]
    for each, sign in zip(ends, (-1, 1, -1), strict=True):
        alone, *_ = each.budget.lines
        # mean reply: 2 ms and 0.5 ms
        assert each.error_s == pytest.approx(sign * 1.25e-3, abs=1.5e-4)
        assert abs(each.error_s) > 20 * (alone.contribution or 0.0)
        assert each.budget.expanded == pytest.approx(1.25e-3, rel=0.08)
    assert abs(course_time.found(4, 0.0).error_s) < 2e-4
