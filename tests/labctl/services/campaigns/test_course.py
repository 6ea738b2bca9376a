"""The course of a campaign: every sample of chamber and units, or the lowest and highest of each span."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from labctl.services.campaigns.course import campaign_course


def store_of(units: dict[str, dict[str, np.ndarray]]) -> Any:
    """Return a store with one campaign, whose recordings have these environments."""
    recordings = {serial: number for number, serial in enumerate(units, start=1)}
    environments = dict(enumerate(units.values(), start=1))
    return SimpleNamespace(
        campaigns=SimpleNamespace(get=lambda _: SimpleNamespace(recordings=recordings)),
        recordings=SimpleNamespace(environment=environments.__getitem__),
    )


def test_few_samples_are_all_there_with_the_units_side_by_side() -> None:
    t_s = np.array([0.0, 10.0, 20.0])
    first = {"t_s": t_s, "temperature_c": t_s + 30, "chamber_c": t_s + 20, "chamber_setpoint_c": np.full(3, 40.0)}
    second = {"t_s": t_s[1:], "temperature_c": t_s[1:] + 31}  # switched on later
    answer = campaign_course(store_of({"A": first, "B": second}), 1, points=100)
    assert (answer.samples, answer.t_s) == (3, [0.0, 10.0, 20.0])
    assert answer.chamber_c == [20.0, 30.0, 40.0]
    assert answer.setpoint_c == [40.0] * 3
    assert answer.units_c == {"A": [30.0, 40.0, 50.0], "B": [None, 41.0, 51.0]}


def test_of_many_samples_no_peak_is_left_out() -> None:
    t_s = np.arange(0.0, 100_000.0)
    air_c = 20 + np.sin(t_s / 1000)
    air_c[[41_234, 77_777]] = -55.0, 91.0
    answer = campaign_course(store_of({"A": {"t_s": t_s, "temperature_c": air_c, "chamber_c": air_c}}), 1, points=500)
    assert answer.samples == 100_000
    assert len(answer.t_s) <= 500
    assert (answer.t_s[0], answer.t_s[-1]) == (0.0, 99_999.0)
    assert answer.t_s == sorted(set(answer.t_s))
    shown = dict(zip(answer.t_s, answer.chamber_c, strict=True))
    assert (shown[41_234.0], shown[77_777.0]) == (-55.0, 91.0)
    assert answer.setpoint_c == [None] * len(answer.t_s)


def test_the_newest_part_begins_at_the_time_that_is_asked_for() -> None:
    t_s = np.arange(0.0, 1000.0)
    store = store_of({"A": {"t_s": t_s, "chamber_c": t_s}, "B": {"t_s": t_s[:500], "temperature_c": t_s[:500]}})
    answer = campaign_course(store, 1, points=2000, from_s=990.0)
    assert (answer.samples, answer.t_s) == (10, list(range(990, 1000)))
    assert answer.chamber_c == answer.t_s
    assert answer.units_c["B"] == [None] * 10


def test_a_unit_turned_by_hand_has_no_chamber_and_a_new_campaign_no_course() -> None:
    by_hand = campaign_course(store_of({"A": {"t_s": np.array([1.0, 2.0]), "temperature_c": np.ones(2)}}), 1, points=10)
    assert (by_hand.chamber_c, by_hand.units_c) == ([None, None], {"A": [1.0, 1.0]})
    empty = campaign_course(store_of({"A": {}}), 1, points=10)
    assert (empty.samples, empty.t_s, empty.units_c) == (0, [], {})
