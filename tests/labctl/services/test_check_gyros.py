"""A check gyro over many campaigns: its charts, the alarm, and what is left out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path

import numpy as np
import pytest

from labctl.answers.calibrations import FitRequest
from labctl.answers.validity import CheckGyroRequest
from labctl.errors import NotEnoughData
from labctl.metrology.control_chart import MIN_HISTORY
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.check_gyros import alarms, check_gyro, list_check_gyros, set_check_gyro
from labctl.store import Store, check, open_store
from tests.helpers import register
from tests.helpers.certificates import simulated
from tests.helpers.register import noon

SERIAL = "CHECK-1"
FIRST = date(2024, 1, 8)
EFFECTS = ["bias", "scale_factor"]


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


def measure(store: Store, week: int, bias_dps: float, scale: float = 0.0, *, fitted: bool = True) -> int:
    """Import a recording of the unit with an error added to its output, and fit it; returns the recording."""
    recording = simulated()
    day = FIRST + timedelta(weeks=week)
    rate = recording.columns["gyro_z"]
    columns = {**recording.columns, "gyro_z": np.asarray(rate) * (1 + scale) + bias_dps}
    info = recording.info.model_copy(update={"serial": SERIAL, "started_at": noon(day), "standards": ()})
    number = store.recordings.add_import(replace(recording, info=info, columns=columns), noon(day))
    if fitted:
        fit_unit(store, SERIAL, FitRequest(effects=EFFECTS, recording=number), noon(day))
    return number


def mark(store: Store, **changed: object) -> None:
    asked = CheckGyroRequest.model_validate({"by": "Q. Manager", "reason": "stays in the laboratory", **changed})
    set_check_gyro(store, SERIAL, asked, noon(FIRST))


@pytest.mark.slow
def test_a_bench_that_changes_is_alarmed_by_the_history(store: Store) -> None:
    random = np.random.default_rng(4)
    for week in range(MIN_HISTORY + 1):
        measure(store, week, float(random.normal(0.0, 1e-4)))
    mark(store)
    quiet = check_gyro(store, SERIAL)
    assert not quiet.alarm
    assert alarms(store) == 0
    assert quiet.text[0].endswith("every result is within the control limits.")
    measure(store, MIN_HISTORY + 1, 2e-3)
    found = check_gyro(store, SERIAL)
    assert found.alarm
    assert alarms(store) == 1
    (bias,) = [chart for chart in found.charts if chart.result == "bias"]
    assert bias.points[-1].state == "out"
    by_history = bias.points[-1].limits[-1]
    assert by_history.basis == "history"
    assert by_history.high - by_history.low < 2e-3
    assert found.text[0].startswith(f"ALARM, check gyro {SERIAL}, recording {MIN_HISTORY + 2}, bias of axis z at")
    (scale,) = [chart for chart in found.charts if chart.result == "scale_factor"]
    assert scale.points[-1].state in {"in", "warning"}


@pytest.mark.slow
def test_a_change_of_the_scale_factor_is_told_from_one_of_the_bias(store: Store) -> None:
    random = np.random.default_rng(5)
    for week in range(MIN_HISTORY):
        measure(store, week, float(random.normal(0.0, 1e-4)), float(random.normal(0.0, 1e-6)))
    measure(store, MIN_HISTORY, 0.0, 5e-4)
    states = {chart.result: chart.points[-1].state for chart in check_gyro(store, SERIAL).charts}
    assert states["scale_factor"] == "out"
    assert states["bias"] != "out"


@pytest.mark.slow
def test_a_new_chart_begins_where_it_is_said_to(store: Store) -> None:
    for week in range(3):
        measure(store, week, 0.0)
    measure(store, 3, 1.0)  # after a repair
    measure(store, 4, 1.0)
    mark(store)
    assert check_gyro(store, SERIAL).alarm
    mark(store, chart_from=FIRST + timedelta(weeks=3), temperature_c=20.0)
    found = check_gyro(store, SERIAL)
    assert [len(chart.points) for chart in found.charts] == [2, 2]
    assert (found.alarm, found.temperature_c, found.marked) == (False, 20.0, True)
    mark(store, marked=False)
    assert not list_check_gyros(store)
    assert not check_gyro(store, SERIAL).marked
    assert not check(store.location).findings  # every act is sealed
    assert [row.action for row in store.audit.rows()][-1] == "check gyro unmark"


def test_a_recording_without_a_version_of_its_own_is_left_out_and_named(store: Store) -> None:
    measure(store, 0, 0.0)
    left = measure(store, 1, 0.0, fitted=False)
    assert check_gyro(store, SERIAL).left_out == {
        left: f"no version is fitted to it alone: `labctl fit {SERIAL} --recording {left}`"
    }
    assert "control limits need a second one" in check_gyro(store, SERIAL).text[0]


def test_a_unit_without_a_version_cannot_be_one(store: Store) -> None:
    measure(store, 0, 0.0, fitted=False)
    with pytest.raises(NotEnoughData, match="has no version; fit one"):
        mark(store)
    register.add(store)  # the register and its standards are not touched by it
    assert alarms(store) == 0
