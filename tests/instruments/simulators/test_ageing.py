"""Ageing of a simulated unit: its bias and scale factors follow the calendar, and nothing else of it changes."""

from __future__ import annotations

from datetime import UTC, date, datetime, timedelta
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VIRTUAL_START, VirtualClock
from instruments.simulation import open_simulation
from instruments.simulators.physics.world import GyroSample

YEAR = timedelta(days=365.25)


def bench(ageing: dict[str, Any] | None) -> BenchFile:
    found = read_bench("triaxial-sim")
    assert found.simulation is not None
    units = {} if ageing is None else {"mems": {"ageing": ageing}}
    return found.model_copy(update={"simulation": found.simulation.model_copy(update={"units": units})})


def sampled(ageing: dict[str, Any] | None, start: datetime, rate_dps: float) -> NDArray[np.float64]:
    """Return the mean output of each axis, (3,) deg/s, at a rate about z."""
    world = open_simulation(bench(ageing), VirtualClock(start)).world
    world.power(0.0, True)
    world.mount(0.0, "z")
    ends_s = world.follow(10.0, 0.1, np.full(101, rate_dps))
    sample: GyroSample = world.gyro("mems").sample(np.arange(11.0, ends_s, 0.1))
    return np.asarray(sample.rate_dps.mean(axis=0))


@pytest.mark.parametrize("rate_dps", [0.0, 200.0])
def test_a_unit_gains_what_its_law_says_for_each_year(rate_dps: float) -> None:
    law = {"bias_dps_per_year": [0.02, -0.01, 0.03], "scale_factor_per_year": 3e-4, "since": date(2026, 1, 1)}
    start = datetime(2026, 1, 1, tzinfo=UTC) + 2 * YEAR
    change = sampled(law, start, rate_dps) - sampled(None, start, rate_dps)
    assert change[2] == pytest.approx(2 * (0.03 + 3e-4 * rate_dps), rel=2e-3)
    assert change[:2] == pytest.approx([0.04, -0.02], abs=2 * 3e-4 * 0.03 * rate_dps + 1e-4)


def test_without_a_law_or_on_its_first_day_a_unit_is_as_its_profile() -> None:
    fresh = sampled(None, VIRTUAL_START, 100.0)
    assert sampled(None, VIRTUAL_START + 5 * YEAR, 100.0) == pytest.approx(fresh, abs=0.0)
    aged = sampled({"bias_dps_per_year": 0.02}, VIRTUAL_START, 100.0)
    assert aged == pytest.approx(fresh, abs=1e-7)  # seconds of a year


def test_a_campaign_keeps_the_day_as_text() -> None:
    kept = BenchFile.model_validate(
        bench({"bias_dps_per_year": 0.5, "since": date(2024, 1, 5)}).model_dump(mode="json")
    )
    found = open_simulation(kept, VirtualClock()).world.gyro("mems").truth.ageing
    assert found is not None
    assert found.since == datetime(2024, 1, 5, tzinfo=UTC)


@pytest.mark.parametrize(
    ("law", "said"),
    [
        ({"bias": 0.1}, "ageing has no bias; write a table of bias_dps_per_year"),
        (0.1, "ageing has no 0.1; write a table"),
        ({"bias_dps_per_year": [0.1, 0.2]}, "give one number, or 3, one for each axis"),
        ({"scale_factor_per_year": "much"}, "ageing.scale_factor_per_year = 'much'"),
        ({"since": "last year"}, "ageing.since = 'last year' is not a date; write 2026-01-05"),
    ],
)
def test_an_invalid_ageing_law_is_refused(law: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said.replace("(", r"\(")):
        open_simulation(bench(law), VirtualClock())
