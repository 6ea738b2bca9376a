"""Campaigns that are interrupted: by a kill, a power cut, a fault or a person; a fixed selection of the studies."""

from __future__ import annotations

import json
import tempfile
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from instruments.clock import VirtualClock
from instruments.errors import NoReply
from labctl.answers.campaigns import ResumeRequest, StartRequest
from labctl.cli.app import app
from labctl.errors import Conflict
from labctl.services.benches.power_failure import power_failed
from labctl.services.campaigns import resume
from labctl.services.campaigns.execution import run, run_here
from labctl.services.campaigns.preparation import prepare
from labctl.services.campaigns.resumability import MAX_RESUMES, retries_exhausted
from labctl.services.campaigns.resume import prepare_resume, resume_here
from labctl.services.planning.loading import load_bench
from labctl.store import CampaignRow, Store, open_store
from labctl.store.connection.database import Database
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.control import Control
from studies import crash_recovery, faults
from studies.crashable_process import all_readings, complete_data_sets

#: Of the 240 kills of `python -m studies crash_recovery` (drawn in equal parts of a campaign, deaths of the process and
#: power cuts in turn); and so many campaigns of `python -m studies faults` have every kind of fault, on all benches.
KILLS, FAULTY = 4, 12


@pytest.fixture(scope="module")
def whole() -> tuple[int, Any]:
    """How many instants an undisturbed campaign has, and what is fitted to it."""
    with tempfile.TemporaryDirectory() as folder:
        return crash_recovery.undisturbed(Path(folder))


@pytest.mark.parametrize("number", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, KILLS))])
def test_a_kill_at_any_instant_loses_nothing_and_repeats_nothing(whole: tuple[int, Any], number: int) -> None:
    instants, expected = whole
    kill = crash_recovery.drawn(instants, KILLS, seed=5)[number]
    verdict = crash_recovery.one((kill, expected))
    assert verdict.well, f"{kill}: {verdict}"


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(FAULTY))
def test_a_faulty_bench_ends_the_campaign_or_not_but_never_hangs_and_never_lies(seed: int) -> None:
    end = faults.one(seed)
    assert end.well, end


@pytest.mark.slow
def test_the_faults_drawn_are_of_every_kind_in_every_instrument() -> None:
    drawn = [(bench.name, each) for seed in range(500) for bench in [faults.benches()[seed % 4]]
             for each in faults.draw(seed, bench)]  # fmt: skip
    assert {each.kind for _, each in drawn} == set(faults.KINDS)
    assert {each.url.partition("/")[2] for _, each in drawn} == {
        url.partition("/")[2] for bench in faults.benches() for url in faults.addresses(bench).values()
    }


def stopped(store: Store, after: str, **changes: Any) -> Any:
    """Run `short` until a step whose text holds `after` begins, and end it there as asked."""
    prepared = prepare(store, "short", load_bench("single-axis-sim"), VirtualClock(), clip=False)
    control = Control()

    def seen(progress: Any) -> None:
        if after in progress.step_text and progress.state == "running":
            changes["act"](prepared, control)

    return prepared, run(store, prepared, control, seen)


@pytest.mark.slow
def test_after_a_fault_a_person_takes_it_up_and_it_cannot_be_finished_twice(tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    with open_store(location, write=True) as store:

        def break_it(prepared: Any, _control: Any) -> None:
            def fail(*_: Any) -> None:
                raise NoReply("table", "no answer")

            prepared.bench.table.spin = fail

        prepared, answer = stopped(store, "data set 4 of", act=break_it)
        assert answer.state == "failed"
        bench = load_bench("single-axis-sim")
        request = ResumeRequest(by="Ada")
        again = run(store, prepare_resume(store, prepared.id, bench, lambda s: VirtualClock(s.last_at), request))
        assert again.state == "done"
        events = store.campaigns.events(prepared.id)
        assert any("resumed by Ada" in event.message for event in events if event.kind == "taken_up")
        times = [event.t_s for event in events]
        assert times == sorted(times)
        points = store.recordings.points(again.recordings["FOG-0001"])
        assert len(points) == 15
        assert np.all(np.diff(np.asarray(points.columns["t_s"])) > 0)
        assert set(np.asarray(points.columns["run"])) == {1, 2}  # a simulated bench ends with its process
        for _ in range(2):
            with pytest.raises(Conflict, match="is done and cannot be resumed"):
                prepare_resume(store, prepared.id, bench, lambda _: VirtualClock(), request)


@pytest.mark.slow
def test_a_resumed_campaign_here_is_the_newest_that_was_interrupted(tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    with open_store(location, write=True) as store:
        prepared = prepare(store, "short", load_bench("single-axis-sim"), VirtualClock(), clip=False)
        prepared.bench.close()
    answer = resume_here(location, None, None, None, ResumeRequest())
    assert (answer.state, answer.id) == ("done", prepared.id)
    with pytest.raises(Conflict, match="no campaign was interrupted"):
        resume_here(location, None, None, None, ResumeRequest())


def test_another_bench_is_refused(tmp_path: Path) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        prepared = prepare(store, "short", load_bench("single-axis-sim"), VirtualClock(), clip=False)
        prepared.bench.close()
        with pytest.raises(Conflict, match="has the units STIM-0001"):
            prepare_resume(store, prepared.id, load_bench("triaxial-sim"), lambda _: VirtualClock(), ResumeRequest())


@pytest.mark.slow
def test_what_is_not_confirmed_safe_stays_until_a_person_clears_it(tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    with open_store(location, write=True) as store:

        def break_it(prepared: Any, control: Control) -> None:
            def fail() -> float:
                raise NoReply("chamber", "no answer")

            prepared.bench.chamber.make_safe = fail
            control.abort("tea")

        _, answer = stopped(store, "data set 2 of", act=break_it)
        assert answer.state == "aborted"
        assert "NOT confirmed safe: chamber to its safe set point: chamber: no answer" in answer.reason
    for command in (["campaign", "start", "short", "--bench", "single-axis-sim"], ["campaign", "resume", "1"]):
        refused = labctl(location, *command)
        assert refused.exit_code == 2
        assert "labctl bench clear single-axis-sim" in refused.stderr
    status = labctl(location, "bench", "status", "--json")
    assert (status.exit_code, "no answer" in json.loads(status.stdout)[0]["unconfirmed"]) == (1, True)
    assert labctl(location, "bench", "clear", "single-axis-sim", "--by", "Ada").exit_code == 0
    assert labctl(location, "bench", "status").exit_code == 0
    assert (
        "its safe state is confirmed already"
        in labctl(location, "bench", "clear", "single-axis-sim", "--by", "Ada").stderr
    )
    assert json.loads(labctl(location, "campaign", "resume", "1", "--by", "Ada", "--json").stdout)["state"] == "done"
    with open_store(location, write=False) as store:
        assert store.audit.first_broken() is None


def labctl(location: str, *arguments: str) -> Any:
    return CliRunner().invoke(app, [*arguments, "--database", location])


def test_a_campaign_that_never_gets_on_waits_for_a_person(tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    with open_store(location, write=True) as store:
        bench = load_bench("single-axis-sim")
        number = prepare(store, "short", bench, VirtualClock(), clip=False).id
        for tries in range(MAX_RESUMES):
            point = store.resume_points.of_campaign(number)
            assert (point.tries, retries_exhausted(point)) == (tries, None)
            prepare_resume(store, number, bench, lambda s: VirtualClock(s.last_at), ResumeRequest()).bench.close()
        assert "without finishing a step" in (retries_exhausted(store.resume_points.of_campaign(number)) or "")


def test_a_host_that_was_off_means_that_the_units_were() -> None:
    assert [power_failed("a", "a"), power_failed("a", "b"), power_failed(None, "a"), power_failed("a", None)] == [
        False, True, True, True,
    ]  # fmt: skip


@pytest.mark.slow
def test_a_unit_that_drops_out_is_written_down_and_its_recording_ends_there(tmp_path: Path) -> None:
    bench = faults.benches()[3]
    database = Database(str(tmp_path / "lab.sqlite"), write=True)
    store = Store(database)
    prepared = prepare(store, faults.RECIPE, bench, VirtualClock(), clip=False)
    simulation: Any = prepared.bench.simulation
    simulation.faults("sim://kvh-dsp3000/dsp").arm("silence", from_s=600.0)
    answer = run(store, prepared)
    assert (answer.state, set(answer.dropped)) == ("done", {"dsp"})
    ends = {serial: len(store.recordings.points(number)) for serial, number in answer.recordings.items()}
    assert ends["FOG-0001"] == 12
    assert 0 < ends["DSP-1"] < 12
    assert store.resume_points.of_campaign(answer.id).dropped.keys() == {"dsp"}
    assert len(all_readings(database)) > 0
    assert set(complete_data_sets(database)) == set(range(1, 13))
    store.close()


@pytest.mark.slow
def test_the_same_seed_gives_the_same_campaign_after_an_interruption(tmp_path: Path) -> None:
    found = []
    for name in ("a", "b"):
        location = str(tmp_path / f"{name}.sqlite")
        with open_store(location, write=True) as store:
            prepared, _ = stopped(store, "data set 3 of", act=lambda _, control: control.abort("tea"))
        resume_here(location, prepared.id, None, None, ResumeRequest())
        with open_store(location, write=False) as store:
            found.append(store.recordings.points(1).columns["gyro_z"])
    assert np.array_equal(found[0], found[1])


@pytest.mark.slow
def test_run_here_leaves_an_uninterrupted_campaign_as_it_was(tmp_path: Path) -> None:
    answer = run_here(str(tmp_path / "lab.sqlite"), StartRequest(recipe="short"))
    assert (answer.state, answer.reason, answer.wish, answer.prompt) == ("done", "all steps done", None, None)


def test_another_release_of_a_driver_is_stated_when_a_campaign_is_resumed() -> None:
    bench = load_bench("single-axis-sim")
    record = bench.model_dump(mode="json")
    record["drivers"]["fog"] |= {"distribution": "acme-fog", "version": "0.1"}

    def row() -> CampaignRow:
        at, state = datetime(2026, 3, 2, tzinfo=UTC), CampaignState.INTERRUPTED
        return CampaignRow(1, "short", {}, bench.name, dict(record), "", 0.0, state, "", at, at, None, {})

    now = bench.drivers["fog"]
    assert resume._other_drivers(row(), bench) == (
        f"; driver of fog: kvh-rd2100 of labctl {now.version} instead of kvh-rd2100 of acme-fog 0.1"
    )
    del record["drivers"]
    assert resume._other_drivers(row(), bench) == "", "a campaign of an earlier labctl"
