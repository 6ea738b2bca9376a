"""Times and cron lines as a person writes them, on the days on which the clocks change too."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

import pytest
from hypothesis import given
from hypothesis import strategies as st

from labctl.errors import BadInput
from labctl.services.schedule.times import check_cron, last_due, moment, next_due, time_zone

BERLIN = ZoneInfo("Europe/Berlin")
SPRING = datetime(2026, 3, 28, 12, tzinfo=UTC)  # the day before 02:00 becomes 03:00
AUTUMN = datetime(2026, 10, 24, 12, tzinfo=UTC)  # the day before 03:00 becomes 02:00
NOW = datetime(2026, 1, 5, 8, tzinfo=UTC)


def dues(line: str, after: datetime, until: datetime) -> list[datetime]:
    found = []
    due = next_due(line, BERLIN, after)
    while due is not None and due < until:
        found.append(due)
        due = next_due(line, BERLIN, due)
    return found


def written(line: str, day: datetime) -> list[str]:
    return [f"{due.astimezone(BERLIN):%d %H:%M %z}" for due in dues(line, day, day + timedelta(days=2))]


def test_a_time_that_the_clocks_jump_over_comes_right_after_the_jump() -> None:
    assert written("30 2 * * *", SPRING) == ["29 03:00 +0200", "30 02:30 +0200"]


def test_two_times_that_fall_together_come_once() -> None:
    assert written("0 2,3 * * *", SPRING) == ["29 03:00 +0200", "30 02:00 +0200", "30 03:00 +0200"]


def test_a_time_that_comes_twice_is_the_first() -> None:
    assert written("30 2 * * *", AUTUMN) == ["25 02:30 +0200", "26 02:30 +0100"]


def test_an_entry_made_in_the_second_of_two_equal_hours_waits_for_the_next_day() -> None:
    second_pass = datetime(2026, 10, 25, 1, 10, tzinfo=UTC)  # 02:10 for the second time
    due = next_due("30 2 * * *", BERLIN, second_pass)
    assert due == datetime(2026, 10, 26, 1, 30, tzinfo=UTC)


def test_a_line_with_a_star_runs_by_elapsed_time() -> None:
    assert written("30 * * * *", AUTUMN)[11:15] == [
        "25 01:30 +0200",
        "25 02:30 +0200",
        "25 02:30 +0100",
        "25 03:30 +0100",
    ]
    assert written("30 * * * *", SPRING)[11:14] == ["29 00:30 +0100", "29 01:30 +0100", "29 03:30 +0200"]


LINES = ["30 2 * * *", "0 2,3 * * *", "*/30 2 * * *", "15,45 1-3 * * *", "59 2 * * SUN", "0 */2 * * *"]


@given(st.sampled_from(LINES), st.sampled_from([SPRING, AUTUMN]), st.integers(0, 30 * 3600))
def test_the_last_due_time_is_the_newest_of_the_next_ones(line: str, day: datetime, later_s: int) -> None:
    now = day + timedelta(seconds=later_s)
    before = dues(line, day, now + timedelta(microseconds=1))
    first = next_due(line, BERLIN, day)
    assert first is not None
    if before:
        assert last_due(line, BERLIN, first, now) == before[-1]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("30 2 * *", "4 fields"),
        ("0 30 2 * * *", "6 fields"),
        ("@daily", "1 fields"),
        ("61 2 * * *", "bad minute"),
        ("30 25 * * *", "bad hour"),
        ("30 2 * * MOON", "bad day-of-week"),
        ("0 0 31 2 *", "bad day-of-month"),
        ("* * */20 * 1L", "matches no time"),
    ],
)
def test_a_wrong_cron_line_is_named(line: str, words: str) -> None:
    with pytest.raises(BadInput, match=words):
        check_cron(line, BERLIN, NOW)


def test_a_time_without_zone_is_meant_in_the_zone_given() -> None:
    assert moment("2026-07-01T08:00", BERLIN, NOW) == datetime(2026, 7, 1, 6, tzinfo=UTC)
    assert moment("2026-07-01T08:00Z", BERLIN, NOW) == datetime(2026, 7, 1, 8, tzinfo=UTC)
    assert moment("2026-07-01T08:00-05:00", BERLIN, NOW) == datetime(2026, 7, 1, 13, tzinfo=UTC)
    assert moment("now", BERLIN, NOW) == NOW


def test_of_a_time_that_comes_twice_the_first_is_meant() -> None:
    assert moment("2026-10-25T02:30", BERLIN, NOW) == datetime(2026, 10, 25, 0, 30, tzinfo=UTC)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("2026-03-29T02:30", "does not exist in Europe/Berlin"),
        ("2026-01-05T08:59", "is in the past: it is now 2026-01-05 09:00"),
        ("tomorrow", "cannot be read"),
        ("", "cannot be read"),
        ("0001-01-01T00:00+14:00", "cannot be read"),
    ],
)
def test_a_wrong_time_is_named(text: str, words: str) -> None:
    with pytest.raises(BadInput, match=words):
        moment(text, BERLIN, NOW)


@pytest.mark.parametrize("name", ["Europe/Atlantis", "", "../etc/passwd", "Europe"])
def test_an_unknown_time_zone_is_named(name: str) -> None:
    with pytest.raises(BadInput, match="time zone"):
        time_zone(name)
