"""The progress shows what the guards watch: each value with its limits, what a trip does, and how old it is."""

from __future__ import annotations

import pytest

from procedures.monitoring.progress import Progress, WatchedLimit
from tests.helpers.engine_rig import Rig


def test_progress_has_every_watched_value_with_its_limits_and_age(rig: Rig) -> None:
    seen: list[tuple[str, tuple[WatchedLimit, ...]]] = []

    def observe(progress: Progress) -> None:
        if progress.limits:
            seen.append((progress.step_text, progress.limits))

    rig.run(observer=observe)
    kinds = {limit.kind for _, limits in seen for limit in limits}
    assert {"chamber_limits", "unit_air", "unit_temperature", "stale", "chamber_deviation", "rate"} <= kinds
    for _, limits in seen:
        air = next(limit for limit in limits if limit.kind == "chamber_limits")
        assert air.low is not None
        assert air.low < air.value < air.high
        assert (air.unit, air.action, air.is_beyond) == ("deg C", "fail", False)
        assert air.age_s == pytest.approx(0.0, abs=1.0)  # it was polled just now
        assert [limit.low for limit in limits if limit.kind == "stale"] == [None] * (
            sum(limit.kind == "stale" for limit in limits)
        )


def test_a_passed_limit_is_beyond_in_the_progress_and_an_event(rig: Rig) -> None:
    beyond: list[WatchedLimit] = []
    rig.chamber.alarms = ("door open",)
    rig.run(observer=lambda progress: beyond.extend(limit for limit in progress.limits if limit.is_beyond))
    assert {(limit.kind, limit.device, limit.value) for limit in beyond} == {("chamber_alarm", rig.chamber.name, 1.0)}
    assert [event.kind for event in rig.journal.events if event.kind.startswith("guard.")] == ["guard.chamber_alarm"]
