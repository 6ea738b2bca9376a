"""When a plan needs a person, which of these times are at night, and which start is better."""

from __future__ import annotations

from datetime import UTC, datetime
from zoneinfo import ZoneInfo

import pytest

from instruments.bench_config import BenchFile
from labctl.services.planning.attendance import attendance, visits_s
from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.services.schedule.planned_start import planned_start
from procedures.contracts.steps import Mount, PowerOff, PowerOn
from procedures.planning.plan import Plan, make_plan
from procedures.planning.step_writer import MOUNTING_S

BERLIN = ZoneInfo("Europe/Berlin")
HOUR_S = 3600.0
BENCH = load_bench("triaxial-sim")


def real(bench: BenchFile) -> BenchFile:
    """Return a bench with the links of real instruments."""
    gyros = tuple(unit.model_copy(update={"port": f"/dev/ttyUSB{n}"}) for n, unit in enumerate(bench.gyros, start=1))
    table = bench.table.model_copy(update={"port": "/dev/ttyUSB0"})
    chamber = bench.chamber.model_copy(update={"host": "10.0.0.7"})
    return bench.model_copy(update={"table": table, "chamber": chamber, "gyros": gyros, "simulation": None})


def plan(recipe: str) -> Plan:
    return make_plan(load_recipe(recipe), limits_of(BENCH), clip=True)


def test_every_prompt_of_a_real_bench_is_a_visit_and_those_close_together_are_one() -> None:
    made = plan("short")
    prompts_s, start_s = [], 0.0
    for step in made.steps:
        if isinstance(step, Mount | PowerOn | PowerOff):
            prompts_s.append(start_s)
        start_s += step.expected_s
    visits = visits_s(made, real(BENCH))
    assert len(prompts_s) > len(visits) >= 1
    assert visits[0] == prompts_s[0]
    assert all(min(abs(prompt - visit) for visit in visits) <= 4 * 1800.0 for prompt in prompts_s)


def test_a_bench_with_a_unit_handler_needs_nobody() -> None:
    assert visits_s(plan("short"), BENCH) == []
    assert attendance([], datetime(2026, 3, 24, 20, tzinfo=UTC), BERLIN) is None


def test_a_plan_counts_the_time_of_a_person_where_one_is_needed() -> None:
    by_person = make_plan(load_recipe("short"), limits_of(real(BENCH)), clip=True)
    mounts = sum(isinstance(step, Mount) for step in by_person.steps)
    assert by_person.expected_s - plan("short").expected_s == pytest.approx(mounts * MOUNTING_S)


def test_times_are_of_the_bench_and_those_at_night_are_warned_of() -> None:
    start = datetime(2026, 3, 23, 19, 40, tzinfo=UTC)  # 20:40 in Berlin
    answer = attendance([6.5 * HOUR_S, 13 * HOUR_S], start, BERLIN)
    assert answer is not None
    assert answer.text == "needs a person at Tue 03:10 and Tue 09:40 (Europe/Berlin)"
    assert [f"{time:%H:%M}" for time in answer.at_night] == ["03:10"]
    assert answer.warning.startswith(
        "Tue 03:10 is between 20:00 and 07:00; a start at Tue 00:30 needs no person at night"
    )
    assert answer.better_start == datetime(2026, 3, 24, 0, 30, tzinfo=BERLIN)


def test_the_better_start_has_nobody_at_night_and_is_the_next_such() -> None:
    answer = attendance([0.0, 4 * HOUR_S], datetime(2026, 3, 24, 22, 7, tzinfo=BERLIN), BERLIN)
    assert answer is not None
    assert answer.better_start == datetime(2026, 3, 25, 7, 0, tzinfo=BERLIN)
    again = attendance([0.0, 4 * HOUR_S], answer.better_start, BERLIN)
    assert again is not None
    assert (again.warning, again.at_night, again.better_start) == ("", [], None)


def test_where_no_start_avoids_the_night_the_one_with_the_fewest_is_named() -> None:
    every_six_hours = [6 * HOUR_S * n for n in range(4)]
    answer = attendance(every_six_hours, datetime(2026, 3, 24, 3, 0, tzinfo=BERLIN), BERLIN)
    assert answer is not None
    assert len(answer.at_night) == 2
    assert "no start has fewer" in answer.warning or "only" in answer.warning


def test_many_times_are_counted_and_a_long_plan_names_dates() -> None:
    answer = attendance([24 * HOUR_S * n for n in range(10)], datetime(2026, 3, 24, 12, tzinfo=BERLIN), BERLIN)
    assert answer is not None
    assert "Tue 24 Mar 12:00" in answer.text
    assert "and 2 more" in answer.text


@pytest.mark.parametrize(
    ("at", "cron", "due"),
    [
        (None, None, "2026-01-05 09:00"),
        ("2026-01-06T22:00", None, "2026-01-06 22:00"),
        (None, "0 20 * * FRI", "2026-01-09 20:00"),
    ],
)
def test_the_planned_start_is_the_next_due_time(at: str | None, cron: str | None, due: str) -> None:
    start, zone = planned_start(at, cron, "Europe/Berlin", datetime(2026, 1, 5, 8, tzinfo=UTC))
    assert f"{start.astimezone(zone):%Y-%m-%d %H:%M}" == due
