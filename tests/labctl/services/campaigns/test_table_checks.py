"""Campaigns on a table that measures its own steps: a slow step clock, and steps that were missed."""

from __future__ import annotations

import json
import sqlite3
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.drivers.arrick_c4 import ArrickC4
from instruments.drivers.arrick_c4_checks import Homing, TimedHome
from instruments.drivers.resolution import resolve
from instruments.standards import MEASURED_STEP_CLOCK
from labctl.answers.campaigns import ResumeRequest
from labctl.fitting import fit
from labctl.recording import RecordingInfo
from labctl.services.benches.standards import standards_of
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.services.campaigns.resume import prepare_resume
from labctl.store import open_store
from procedures.contracts.control import Control
from procedures.monitoring.step_clock import fitted
from studies.table_clock import KINDS, Kind, campaign, resumed_campaign

RECIPE = """format = "labctl-recipe/1"
name = "checked"
temperatures_c = [24, 26]
rates_dps = [-90, -30, 0, 30, 90]
positions = ["z"]
[soak]
hold_s = 120
max_drift_c = 1.0
drift_window_s = 60
[acquire]
duration_s = 20
settle_s = 2
"""


def checked_bench(**table: Any) -> BenchFile:
    record = read_bench("single-axis-sim").model_dump()
    record["table"] |= {"clock_run_s": 60.0, "check_home": True}
    record["simulation"]["table"] |= table
    return resolve(BenchFile.model_validate(record))


def rows(location: str, query: str) -> list[Any]:
    with sqlite3.connect(location) as raw:
        found = raw.execute(query).fetchall()
    raw.close()
    return found


def scale_of(location: str, ratio: float) -> float:
    """Return the scale factor that a campaign finds on a table whose steps run at `ratio` of the nominal rate."""
    with open_store(location, write=True) as store:
        recipe = RECIPE.replace("[24, 26]", "[25]")
        prepared = prepare(store, recipe, checked_bench(step_clock_ratio=ratio), VirtualClock(), clip=False)
        kinds = [step.kind for step in prepared.plan.steps]
        assert kinds[:2] == ["home", "measure_clock"]
        assert kinds.count("check_home") == 2  # before and after each temperature
        answer = run(store, prepared)
        assert answer.state == "done", answer.reason
        points = store.recordings.points(next(iter(answer.recordings.values())))
    recorded = np.asarray(points.columns["table_rate_dps"])
    assert np.allclose(np.unique(np.round(recorded)), [-90, -30, 0, 30, 90])
    found = fit(points, "single_temperature").fitted.axes["z"]
    return 1 + float(dict(zip(found.names, found.values[:, 0], strict=True))["scale_factor"])


@pytest.mark.slow
def test_with_a_slow_step_clock_the_reference_and_the_fit_are_right(tmp_path: Path) -> None:
    """Steps 9.1 % slow: without the measurement the table does 81.8 deg/s where 90 are recorded."""
    exact, slow = str(tmp_path / "exact.sqlite"), str(tmp_path / "slow.sqlite")
    assert scale_of(slow, 1 / 1.1) == pytest.approx(scale_of(exact, 1.0), abs=1e-5)
    for location, ratio in ((exact, 1.0), (slow, 1 / 1.1)):
        measured = rows(location, "select result from steps where kind = 'measure_clock' order by number")
        figures = [json.loads(each)["figures"] for (each,) in measured]
        assert [each["runs"] for each in figures] == [4, 6]  # before the first data set, and after the last
        assert [each["step_clock_ratio"] for each in figures] == pytest.approx([ratio, ratio], abs=3e-6)
        for level, message, value in rows(
            location, "select level, message, value from events where kind = 'table_clock'"
        ):
            assert level == ("info" if ratio == 1 else "warning")
            assert value == pytest.approx(1e6 * (ratio - 1), abs=3)
            assert ("set step_clock_hz = 18181" in message) is (ratio != 1)


@pytest.mark.slow
def test_rates_are_by_all_timed_runs_and_their_scatter_is_in_the_record(tmp_path: Path) -> None:
    """A clock that drifts by 200 ppm/h, behind an adapter that passes bytes on every 4 ms."""
    location = str(tmp_path / "lab.sqlite")
    simulated = {"step_clock_ratio": 0.99965, "step_clock_drift_ppm_per_h": 200.0, "reply_latency_s": 0.004}
    with open_store(location, write=True) as store:
        recipe = RECIPE.replace("hold_s = 120", "hold_s = 3600")
        bench = checked_bench(**simulated)
        (expected,) = [each for each in standards_of(bench) if each.name == MEASURED_STEP_CLOCK]
        prepared = prepare(store, recipe, bench, VirtualClock(), clip=False)
        assert run(store, prepared).state == "done"
        recording = next(iter(store.campaigns.get(prepared.id).recordings.values()))
        (stated,) = [
            each
            for each in RecordingInfo.model_validate(store.recordings.get(recording).info).standards
            if each.name == MEASURED_STEP_CLOCK
        ]
        runs = store.resume_points.of_campaign(prepared.id).clock_runs
    (last,) = rows(location, "select result from steps where kind = 'measure_clock' order by number desc limit 1")
    figures = json.loads(last[0])["figures"]
    assert (stated.u, stated.freedom) == (figures["u_ppm"], figures["freedom"])
    assert expected.standard_u == pytest.approx(1e6 * np.sqrt(2) * 0.016 / np.sqrt(12) / 60)
    assert all(each.used for each in runs)
    assert len(runs) == 6
    device = prepared.bench.simulation.device("sim://arrick")._device  # type: ignore[union-attr]
    for rate_dps, gate_s in rows(location, "select table_rate_dps, gate_from_s from data_sets where asked_dps != 0"):
        true = 0.99965 + 1e-6 * 200.0 * gate_s / 3600.0
        divisor = round(true * device._clock_hz * device._step_deg / abs(rate_dps))
        true_dps = true * device._clock_hz / divisor * device._step_deg
        assert abs(abs(rate_dps) / true_dps - 1) * 1e6 < figures["expanded_ppm"]


@pytest.mark.slow
@pytest.mark.parametrize(("changed", "state"), [(0.0, "done"), (1e-3, "failed")])
def test_a_resumed_campaign_compares_its_clock_with_that_before(tmp_path: Path, changed: float, state: str) -> None:
    location = str(tmp_path / "lab.sqlite")
    bench = checked_bench(step_clock_ratio=0.999588, reply_latency_s=0.001)
    with open_store(location, write=True) as store:
        prepared = prepare(store, RECIPE, bench, VirtualClock(), clip=False)
        control = Control()
        device = prepared.bench.simulation.device("sim://arrick")._device  # type: ignore[union-attr]
        move, moves = device._move, []

        def leaving(way: str, steps: int, divisor: int, t_s: float) -> None:
            moves.append(steps)
            if len(moves) == 15:
                control.interrupt("the service is stopped")
            move(way, steps, divisor, t_s)

        device._move = leaving
        assert run(store, prepared, control=control).state == "interrupted"
        other = checked_bench(step_clock_ratio=0.999588 + changed, reply_latency_s=0.001)
        request = ResumeRequest(by="A. Person", power="lost")
        resumed = prepare_resume(store, prepared.id, other, lambda standing: VirtualClock(standing.last_at), request)
        assert len(resumed.restart.clock_runs) == 4  # type: ignore[union-attr]
        answer = run(store, resumed)
        assert answer.state == state, answer.reason
        if state == "failed":  # its runs do not count afterwards
            again = prepare_resume(store, prepared.id, bench, lambda standing: VirtualClock(standing.last_at), request)
            assert run(store, again).state == "done"
    sessions = rows(location, "select session, count(*) from timed_runs group by session order by session")
    assert sessions[:2] == [(1, 4), (2, 4 if state == "failed" else 6)]
    if state == "failed":
        assert "the step clock has changed by +10" in answer.reason
        used = rows(location, "select session, min(used), max(used) from timed_runs group by session order by session")
        assert used == [(1, 1, 1), (2, 0, 0), (3, 1, 1)]
        (last,) = rows(location, "select result from steps where kind = 'measure_clock' order by number desc limit 1")
        figures = json.loads(last[0])["figures"]
        assert figures["runs"] == 10  # four before, four when it was resumed the second time, two at the end
        with open_store(location, write=False) as store:
            runs = [each for each in store.resume_points.of_campaign(prepared.id).clock_runs if each.used]
        found = fitted(runs)
        assert found is not None
        assert figures["deviation_ppm"] == pytest.approx(1e6 * (found.ratio(found.until_s) - 1), abs=1e-6)
        assert figures["deviation_expanded_ppm"] == pytest.approx(found.expanded_ppm(found.until_s), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [KINDS[0], KINDS[3], KINDS[4]], ids=lambda kind: kind.drift)
def test_what_a_resumed_campaign_states_of_its_clock_holds_at_least_as_often_as_it_says(kind: Kind) -> None:
    """Behind an adapter of 1 ms, through the bytes: one campaign in twenty may be further off than its U at 95 %."""
    error_ppm, u_ppm = np.array([resumed_campaign(kind, 0.001, (32, n)) for n in range(200)]).T
    assert np.mean(np.abs(error_ppm) <= u_ppm) >= 0.92  # two standard deviations of 200 draws below 95 %
    assert np.median(u_ppm) < 5 * np.sqrt(np.mean(error_ppm**2))  # and not because U is too large


def test_replies_at_ticks_are_late_otherwise_in_each_campaign_of_the_study() -> None:
    """Each controller's clock is off by its own amount: else the ticks fall alike, and many campaigns are one."""
    ticks = KINDS[4]
    errors = np.array([campaign(ticks, 0.016, (33, n))[2] for n in range(12)])  # in U
    assert errors.std() > 0.3  # 0.16 where all clocks are off by the same
    assert np.abs(errors).max() < 1.0


def test_runs_that_disagree_are_refused_before_the_first_data_set(tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    rng = np.random.default_rng(5)
    with open_store(location, write=True) as store:
        prepared = prepare(store, RECIPE, checked_bench(), VirtualClock(), clip=False)
        device = prepared.bench.simulation.device("sim://arrick")._device  # type: ignore[union-attr]
        finish = device._finish
        device._finish = lambda end_s, t_s: finish(end_s + 0.5 * float(rng.random()), t_s)
        answer = run(store, prepared)
    assert answer.state == "failed"
    assert "table: the runs that time the step clock disagree: U = " in answer.reason
    assert "limit 1000 ppm; end other work on this computer" in answer.reason
    assert rows(location, "select count(*) from data_sets") == [(0,)]
    assert rows(location, "select count(*) from timed_runs") == [(12,)]


@pytest.mark.slow
def test_missed_steps_end_the_campaign_and_the_data_sets_since_the_last_check(tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    with open_store(location, write=True) as store:
        prepared = prepare(store, RECIPE, checked_bench(), VirtualClock(), clip=False)
        device = prepared.bench.simulation.device("sim://arrick")._device  # type: ignore[union-attr]
        move, moves = device._move, []

        def missing(way: str, steps: int, divisor: int, t_s: float) -> None:
            moves.append(steps)
            device.missed_steps = 16 if len(moves) == 15 else 0  # at the second temperature
            move(way, steps, divisor, t_s)

        device._move = missing
        answer = run(store, prepared)
    assert answer.state == "failed"
    assert "table: home is 16 steps (3.6 deg) from where it was left, u = 1.0 steps, " in answer.reason
    assert "limit 2 steps, at 26 deg C" in answer.reason
    states = [state for (state,) in rows(location, "select state from data_sets order by number")]
    assert states == ["complete"] * 5 + ["partial"] * 5
    (reasons,) = rows(location, "select distinct reason from data_sets where state = 'partial'")
    assert "steps were missed" in reasons[0]


def test_a_check_for_missed_steps_that_sees_little_says_how_much(tmp_path: Path) -> None:
    """Homings from one place scatter by more than the limit, however often the homing is learned."""
    location = str(tmp_path / "lab.sqlite")
    with open_store(location, write=True) as store:
        prepared = prepare(
            store, RECIPE.replace("[24, 26]", "[25]"), checked_bench(), VirtualClock(), clip=False
        )  # fmt: skip
        table = prepared.bench.table
        assert isinstance(table, ArrickC4)
        timed, calls = table._timed_home, []

        def scattered(learned: Homing | None = None) -> TimedHome:
            calls.append(0.1 * (len(calls) % 5 == 1))
            home = timed(learned)
            return replace(home, took_s=home.took_s + calls[-1])

        table._timed_home = scattered  # type: ignore[method-assign]
        assert run(store, prepared).state == "done"
    (said,) = {text for (text,) in rows(location, "select message from events where kind = 'home_uncertain'")}
    assert "the check for missed steps is blind below" in said
    assert "limit 2 steps, because homings from one place scatter (u = " in said
    assert "end other work on this computer" in said


@pytest.mark.slow
def test_a_unit_that_sends_angles_instead_of_rates_is_found_and_nothing_that_it_sent_counts(tmp_path: Path) -> None:
    """Like a DSP-3000 in incremental mode that hears no command: 1 deg/s where the table turns at 10."""
    location, recipe = str(tmp_path / "lab.sqlite"), RECIPE.replace("[24, 26]", "[25]")
    with open_store(location, write=True) as store:
        prepared = prepare(store, recipe, checked_bench(), VirtualClock(), clip=False)
        device = prepared.bench.simulation.device("sim://kvh-rd2100/fog")._device  # type: ignore[union-attr]
        line = device.line
        device.line = lambda rate_dps, temperature_c: line(rate_dps / 10.0, temperature_c)
        answer = run(store, prepared)
        assert answer.state == "failed"
        assert "fog: from " in answer.reason
        assert "10.1 % of that, limits 50 and 200 %" in answer.reason
        assert "one that sends the angle of each sample instead of the rate" in answer.reason
        states = rows(location, "select distinct state, reason from data_sets where planned = 1")
        assert states == [("partial", answer.reason)]
        assert rows(location, "select count(*) from data_sets where state = 'complete'") == [(0,)]
        assert rows(location, "select count(*) from events where kind = 'data_set_withdrawn'") == [(1,)]
        request = ResumeRequest(by="A. Person", power="kept")  # the unit is set right meanwhile
        make_clock = lambda standing: VirtualClock(standing.last_at)  # noqa: E731
        resumed = prepare_resume(store, prepared.id, checked_bench(), make_clock, request)
        assert run(store, resumed).state == "done"
    complete = rows(location, "select planned, count(*) from data_sets where state = 'complete' group by planned")
    assert complete == [(1, 1), (2, 1), (3, 1), (4, 1), (5, 1)]
