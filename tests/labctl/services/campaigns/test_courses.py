"""Campaigns whose rate changes, through the bytes of a servo table: reference, fit, stop, resume, faults, refusals."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.drivers.resolution import resolve
from labctl.answers.calibrations import FitRequest
from labctl.answers.campaigns import ResumeRequest
from labctl.fitting import fit
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import Prepared, prepare
from labctl.services.campaigns.resume import prepare_resume
from labctl.services.planning.loading import limits_of, load_bench, load_recipe, plan_for
from labctl.services.simulation.plan_simulation import simulate
from labctl.store import Store, open_store
from procedures.contracts.control import Control
from procedures.contracts.errors import PlanRefused
from procedures.planning.plan import make_plan

RECIPE = """format = "labctl-recipe/1"
name = "courses"
temperatures_c = [25]
rates_dps = [0]
positions = ["z"]
[[profiles]]
kind = "sine_sweep"
amplitude_dps = 8
from_hz = 0.1
to_hz = 1.5
duration_s = 40
[[profiles]]
kind = "ramp"
from_dps = -30
to_dps = 30
duration_s = 20
[soak]
hold_s = 60
max_drift_c = 1.0
drift_window_s = 30
[acquire]
duration_s = 10
settle_s = 2
"""
AT = datetime(2026, 11, 26, tzinfo=UTC)
MODEL = ["bias", "scale_factor", "time_delay"]
#: The simulated encoder gives the angle as of the question; the driver takes the middle between question and answer.
REPLY_S = 0.002


def servo_bench(table: dict[str, Any] | None = None, **simulated: Any) -> BenchFile:
    """Return the servo bench with a unit of a linear law and almost no noise."""
    record = read_bench("servo-sim").model_dump()
    record["table"] |= table or {}
    record["simulation"]["table"] |= {"reply_s": REPLY_S, "reply_jitter_s": 0.0}
    record["simulation"] |= simulated
    linear = {"profile": "mems-triaxial", "white_dps_rthz": 0.0005, "instability_dps": 0.0001}
    record["simulation"]["units"] = {"fog": linear}
    record["gyros"][0].update(datasheet={}, datasheet_conventions={})
    return resolve(BenchFile.model_validate(record))


def prepared_on(store: Store, bench: BenchFile) -> Prepared:
    return prepare(store, RECIPE, bench, VirtualClock(), clip=False)


def states(store: Store, number: int) -> list[str]:
    return [each.state for each in store.recordings.data_sets(number)]


@pytest.mark.slow
def test_a_course_gives_the_rate_of_each_reading_and_the_fit_uses_it(tmp_path: Path) -> None:
    bench = servo_bench(hidden={"time_delay": 0.02})
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        prepared = prepared_on(store, bench)
        answer = run(store, prepared)
        assert answer.state == "done", answer.reason
        assert not [event for event in store.campaigns.events(prepared.id) if event.level != "info"]
        number = next(iter(answer.recordings.values()))
        recording = store.recordings.samples(number)
        made = fit_unit(store, "FOG-0001", FitRequest(effects=MODEL), AT)
        document = json.loads(store.calibrations.get("FOG-0001", made.version).document)
        assert prepared.bench.simulation is not None
        truth = prepared.bench.simulation.world.gyro("fog").truth
        warm = np.asarray(recording.columns["temperature_c"], dtype=np.float64)
        scale = float(truth.gain(warm)[:, -1, -1].mean()) - 1
    columns = recording.columns
    assert recording.info.motion == "profile"
    assert recording.info.rate_reference == "measured"
    sweep, ramp = (columns["dataset"] == n for n in (1, 2))
    assert int(np.sum(sweep)) in {394, 395, 396}  # all of it but the first half second
    rate = np.asarray(columns["table_rate_dps"], dtype=np.float64)
    assert np.ptp(rate[sweep]) > 15
    assert rate[ramp][0] == pytest.approx(-30 + 3.0 * 0.5, abs=0.5)
    assert np.diff(rate[ramp]) == pytest.approx(np.full(int(ramp.sum()) - 1, 0.3), abs=0.02)
    # what was commanded is kept beside: the servo does it, up to the time of a message
    commanded = np.asarray(columns["computed_rate_dps"], dtype=np.float64)
    assert np.abs(rate - commanded)[sweep].max() < 8 * 2 * np.pi * 1.5 * 0.002
    assert np.all(np.asarray(columns["encoder_rate_u_dps"])[sweep] > 0)
    assert "measured by the encoder" in document["provenance"]["rate_reference"]
    assert document["coefficients"]["z"]["scale_factor"]["value"] == pytest.approx(scale, abs=1e-4)
    found: Any = fit(recording, None, MODEL).to_json()["axes"]["z"]["coefficients"]
    assert found["scale_factor"]["value"] == pytest.approx(scale, abs=3 * found["scale_factor"]["u"] + 2e-5)
    assert found["delay"]["value"] == pytest.approx(0.02 - REPLY_S / 2, abs=1.5e-4)
    # half of a reply, which no fit shows, is in its uncertainty; of the rest at constant rate no time is stated
    budget = document["response"]["z"]["delay"]
    assert budget["combined"] == pytest.approx(found["delay"]["u"], rel=1e-6)
    assert {line["source"] for line in budget["lines"]} == {"coefficients", "table_time", "table_time_common"}
    assert abs(budget["value"] - 0.02) < budget["expanded"] < REPLY_S
    assert np.unique(np.round(columns["table_time_common_u_s"], 6)).tolist() == [0.0, round(REPLY_S / np.sqrt(8), 6)]


@pytest.mark.slow
def test_the_simulation_without_bytes_has_the_same_truth(tmp_path: Path) -> None:
    bench = servo_bench(hidden={"time_delay": 0.02})
    gyro = bench.gyros[0]
    path = tmp_path / "courses.toml"
    path.write_text(RECIPE)
    walked = simulate(make_plan(load_recipe(str(path)), limits_of(bench)), bench, gyro)
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        answer = run(store, prepared_on(store, bench))
        driven = store.recordings.samples(next(iter(answer.recordings.values())))
    scales = [
        fit(each, None, MODEL).to_json()["axes"]["z"]["coefficients"]["scale_factor"]["value"]  # type: ignore[call-overload,index]
        for each in (walked, driven)
    ]
    assert scales[0] == pytest.approx(scales[1], abs=2e-4)
    assert list(np.unique(walked.columns["dataset"])) == list(np.unique(driven.columns["dataset"]))


@pytest.mark.slow
def test_a_stop_in_the_middle_is_obeyed_within_a_second_and_the_course_is_taken_again(tmp_path: Path) -> None:
    bench = servo_bench()
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        prepared, control = prepared_on(store, bench), Control()
        assert prepared.bench.simulation is not None
        world, clock = prepared.bench.simulation.world, prepared.clock
        table: Any = prepared.bench.table
        read, asked = table.read_course_angle, []

        def reading(course: Any) -> Any:
            if not asked and clock.now_s() > course.began_s + 20:
                assert world.table_turns(clock.now_s())
                asked.append(clock.now_s())
                control.abort("a hand in the bench")
            return read(course)

        stopped, stop = [], table.stop

        def stopping() -> None:
            stopped.append(clock.now_s())
            stop()

        table.read_course_angle, table.stop = reading, stopping
        answer = run(store, prepared, control)
        number = next(iter(answer.recordings.values()))
        assert answer.state == "aborted"
        assert stopped[0] - asked[0] < 1.0
        assert not world.table_turns(stopped[0] + 1.0)
        assert states(store, number) == ["partial"]
        again = prepare_resume(store, prepared.id, bench, lambda s: VirtualClock(s.last_at), ResumeRequest(by="Ada"))
        assert run(store, again).state == "done"
        assert states(store, number) == ["partial", "complete", "complete", "complete"]


def test_an_interlock_that_opens_during_a_course_ends_it_with_the_cause(tmp_path: Path) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        prepared = prepared_on(store, servo_bench())
        assert prepared.bench.simulation is not None
        device: Any = prepared.bench.simulation.device("sim://acutrol-3000")
        table: Any = prepared.bench.table
        read = table.read_course_angle

        def reading(course: Any) -> Any:
            if prepared.clock.now_s() > course.began_s + 10 and device._device.axis.interlock == "C":
                device._device.trip(prepared.clock.now_s(), software=1 << 2)
            return read(course)

        table.read_course_angle = reading
        answer = run(store, prepared)
    assert answer.state == "failed"
    assert "position tracking error" in answer.reason
    assert "sine of 8 deg/s from 0.1 to 1.5 Hz" in answer.reason


def test_what_a_bench_cannot_follow_is_refused_when_planned(tmp_path: Path) -> None:
    path = tmp_path / "courses.toml"
    path.write_text(RECIPE)
    with pytest.raises(PlanRefused, match="the driver of the table runs constant rates only; name a bench"):
        plan_for(str(path), "single-axis-sim", clip=False)
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        bench = resolve(read_bench("single-axis-sim"))
        with pytest.raises(PlanRefused, match="constant rates only"):
            prepare(store, str(path), bench, VirtualClock(), clip=False)
    fast = tmp_path / "fast.toml"
    fast.write_text(RECIPE.replace("to_hz = 1.5", "to_hz = 10"))
    with pytest.raises(
        PlanRefused, match=r"profiles\[0\], .* needs 502.67 deg/s\^2, but the limit of the table is 100"
    ):
        plan_for(str(fast), "servo-sim", clip=False)
    plan, *_ = plan_for(str(fast), "servo-sim", clip=True)
    assert [step.course.kind for step in plan.steps if step.kind == "acquire" and step.course] == ["ramp"]
    assert plan_for(str(path), None, clip=False)[1].name == "servo-sim"  # a bench that can is chosen
    assert load_bench("servo-sim").table is not None
