"""What a resume decides, with a store and a bench that are made up: quick, so that its mutants can run."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from instruments.bench_config import BenchFile
from instruments.clock import SystemClock, VirtualClock
from labctl.answers.campaigns import ResumeRequest
from labctl.errors import Conflict
from labctl.services.campaigns import resume
from labctl.services.planning.loading import load_bench, plan_for
from labctl.store import CampaignRow, ResumePoint, Resumption
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.control import Control
from procedures.execution.resume import Restart

BEGUN = datetime(2026, 3, 2, 8, tzinfo=UTC)
POINT = ResumePoint(3, frozenset({2}), frozenset({1}), 100.0, BEGUN, False, 1, "boot", {"fog": "silent"}, (), 0)
SIMULATED = load_bench("single-axis-sim")
REAL = load_bench("example-real")


def row(bench: BenchFile, **changes: Any) -> CampaignRow:
    document = bench.model_dump(mode="json")
    state, units = CampaignState.INTERRUPTED, {gyro.serial: 1 for gyro in bench.gyros}
    made = CampaignRow(7, "short", {}, bench.name, dict(document), "", 0.0, state, "", BEGUN, BEGUN, None, units)
    return replace(made, **changes)


@dataclass
class World:
    """A store with one campaign, and the bench of it; notes what is asked of them, in order."""

    row: CampaignRow = field(default_factory=lambda: row(SIMULATED))
    point: ResumePoint = POINT
    boot: str | None = "boot"
    session: int = 1  #: that is in force at the step where it resumes
    position: str | None = "z"
    fails_at: str = ""
    is_shared: bool = False
    unfinished: list[CampaignRow] = field(default_factory=list)
    acts: list[Any] = field(default_factory=list)
    resumptions: list[Resumption] = field(default_factory=list)

    def note(self, what: str, *more: Any) -> None:
        self.acts.append((what, *more) if more else what)
        if self.fails_at == what:
            raise Conflict(what)

    @property
    def store(self) -> Any:
        return SimpleNamespace(
            is_shared=self.is_shared,
            leases=SimpleNamespace(holder=lambda name: {self.row.bench_name: None}[name]),
            campaigns=SimpleNamespace(get=lambda number: {7: self.row}[number], unfinished=lambda: self.unfinished),
            resume_points=SimpleNamespace(of_campaign=lambda number: {7: self.point}[number],
                                          mark_resumed=self.mark_resumed),
        )  # fmt: skip

    def mark_resumed(self, campaign: int, point: ResumePoint, how: Resumption) -> None:
        assert (campaign, point) == (7, self.point)
        self.resumptions.append(how)
        self.note("marked")

    @property
    def bench(self) -> Any:
        return SimpleNamespace(
            unit_handler=SimpleNamespace(mount=lambda position: self.note("mounted", position)),
            close=lambda: self.note("closed"),
        )

    @property
    def plan(self) -> Any:
        def run_at(index: int, skipped: frozenset[int]) -> int:
            assert (index, skipped) == (self.point.start_at, self.point.skipped)
            return self.session

        return SimpleNamespace(run_at=run_at, mounted_at=lambda index: {3: self.position}[index])

    def open_bench(self, bench_file: BenchFile, clock: object, wire: object) -> Any:
        self.note("opened", bench_file.name, wire)
        return self.bench


@pytest.fixture
def world(monkeypatch: pytest.MonkeyPatch) -> World:
    made = World()
    monkeypatch.setattr(resume, "plan_of", lambda _store, _row: made.plan)
    monkeypatch.setattr(resume, "load_libraries", lambda: made.note("loaded"))
    monkeypatch.setattr(resume, "refuse_unconfirmed", lambda _store, name: made.note("unconfirmed", name))
    monkeypatch.setattr(resume, "open_bench", made.open_bench)
    monkeypatch.setattr(resume, "boot_id", lambda: made.boot)
    monkeypatch.setattr(resume, "_same_units", lambda _row, bench_file: bench_file)
    return made


def resumed(world: World, bench: BenchFile = SIMULATED, *, after_s: float = 160.0, **more: Any) -> Any:
    """Return a resumed campaign so many seconds after it began."""
    request = ResumeRequest(by="Ada", power=more.pop("power", None))
    clock = VirtualClock(BEGUN + timedelta(seconds=after_s))
    return resume.prepare_resume(world.store, 7, bench, lambda point: {POINT.start_at: clock}[point.start_at], request,
                                 **more)  # fmt: skip


def test_a_resumed_campaign_goes_on_where_it_was_at_its_own_time(world: World) -> None:
    prepared = resumed(world, wire="wire")
    assert world.acts == [
        "loaded", ("unconfirmed", SIMULATED.name), ("opened", SIMULATED.name, "wire"), "marked", ("mounted", "z"),
    ]  # fmt: skip
    assert (prepared.id, prepared.start_at, prepared.time.now_s()) == (7, 3, 160.0)
    assert prepared.restart == Restart(60.0, True, 2, {"fog": "silent"}, frozenset({1}), ())
    (how,) = world.resumptions
    reason = "resumed by Ada after 60 s without supervision; the power failed during the interruption"
    assert how == Resumption(160.0, BEGUN + timedelta(seconds=160), reason, 2, new_session=True, boot_id="boot")


def test_on_a_shared_database_a_campaign_is_resumed_on_its_own_bench_only(world: World) -> None:
    other = SIMULATED.model_copy(update={"name": "another"})
    resumed(world, other)
    world.is_shared = True
    resumed(world)
    world.acts.clear()
    with pytest.raises(Conflict, match=r"begun on bench single-axis-sim, not another, .*; no service drives bench"):
        resumed(world, other)
    assert world.acts == ["loaded"]


def test_a_soak_that_was_owed_is_owed_still(world: World) -> None:
    world.point = replace(POINT, soak_owed=True)
    assert resumed(world).restart.gap_s == math.inf


@pytest.mark.parametrize(
    ("begun", "after_s", "t_s"), [(True, 160.0, 160.0), (True, 90.0, 100.0), (False, 160.0, 100.0)]
)
def test_the_time_of_a_campaign_never_goes_back(world: World, begun: bool, after_s: float, t_s: float) -> None:
    world.row = replace(world.row, started_at=BEGUN if begun else None)
    prepared = resumed(world, after_s=after_s)
    assert (prepared.time.now_s(), prepared.restart.gap_s) == (t_s, t_s - 100.0)
    world.row, world.point = replace(world.row, started_at=None), replace(POINT, last_t_s=0.0)
    assert resumed(world).time.now_s() == 0.0


@pytest.mark.parametrize(
    ("bench", "is_open", "power", "boot", "lost"),
    [
        (SIMULATED, False, None, "boot", True),  # a simulated bench ends with its process
        (SIMULATED, False, "kept", "boot", False),
        (SIMULATED, True, None, "boot", False),
        (SIMULATED, True, "lost", "boot", True),
        (SIMULATED, True, None, "another", True),
        (REAL, False, None, "boot", False),
        (REAL, False, None, "another", True),
        (REAL, False, None, None, True),
        (REAL, False, "kept", "another", False),
        (REAL, False, "lost", "boot", True),
    ],
)
def test_whether_the_units_were_off_is_what_a_person_says_else_what_the_computer_knows(
    world: World, bench: BenchFile, is_open: bool, power: str | None, boot: str | None, lost: bool
) -> None:
    world.row, world.boot = row(bench), boot
    prepared = resumed(world, bench, power=power, opened=world.bench if is_open else None)
    (how,) = world.resumptions
    said = "the power failed during the interruption" if lost else "the units stayed on"
    assert how.reason == f"resumed by Ada after 60 s without supervision; {said}"
    assert (prepared.restart.power_lost, how.new_session, how.boot_id) == (lost, lost, boot)
    assert prepared.restart.added_runs == how.added_runs == 1 + lost
    assert (("opened", bench.name, None) in world.acts) is not is_open
    assert (("mounted", "z") in world.acts) is (bench is SIMULATED and not is_open)  # in a new world they lie there


def test_units_that_were_off_anyway_begin_no_session_and_those_that_were_never_turned_are_not_mounted(
    world: World,
) -> None:
    world.session, world.position = 0, None
    prepared = resumed(world)
    assert (prepared.restart.power_lost, world.resumptions[0].new_session, prepared.restart.added_runs) == (
        True, False, 1,
    )  # fmt: skip
    assert world.acts[-1] == "marked"


@pytest.mark.parametrize("fails_at", ["marked", "mounted"])
def test_a_bench_is_closed_again_where_the_campaign_cannot_be_marked_or_mounted(world: World, fails_at: str) -> None:
    world.fails_at = fails_at
    with pytest.raises(Conflict, match=fails_at):
        resumed(world)
    assert world.acts[-1] == "closed"


def test_nothing_is_opened_for_a_campaign_that_is_done_or_whose_bench_is_to_be_inspected(world: World) -> None:
    world.row = row(SIMULATED, state=CampaignState.DONE)
    with pytest.raises(Conflict, match="campaign 7 is done and cannot be resumed; start a new one"):
        resumed(world)
    assert world.acts == ["loaded"]
    world.row, world.fails_at = row(SIMULATED), "unconfirmed"
    with pytest.raises(Conflict, match="unconfirmed"):
        resumed(world)
    assert world.acts[1:] == ["loaded", ("unconfirmed", SIMULATED.name)]


def test_the_log_says_which_step_of_which_campaign_goes_on(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[Any] = []
    monkeypatch.setattr(resume, "log", SimpleNamespace(info=lambda what, **more: said.append((what, more))))
    world.row = row(SIMULATED, recordings={"b": 2, "a": 1})
    resumed(world)
    ((what, fields),) = said
    assert (what, fields["campaign"], fields["bench"], fields["step"]) == ("campaign.resumed", 7, SIMULATED.name, 4)
    assert (fields["was"], fields["units"]) == (CampaignState.INTERRUPTED, ["a", "b"])


def test_the_bench_accepts_only_the_units_that_the_campaign_measures() -> None:
    found = resume._same_units(row(SIMULATED), SIMULATED)
    assert [gyro.serial for gyro in found.gyros] == [gyro.serial for gyro in SIMULATED.gyros]
    assert found.drivers  # with the releases of its drivers
    other = row(SIMULATED, recordings={"B": 1, "A": 2})
    said = rf"campaign 7 measures the units A, B, but bench {SIMULATED.name} has the units FOG-0001; name the bench"
    with pytest.raises(Conflict, match=said):
        resume._same_units(other, SIMULATED)


def test_a_driver_of_another_release_or_name_is_stated_and_one_that_is_new_or_the_same_is_not() -> None:
    release, document = SIMULATED.drivers["fog"], SIMULATED.model_dump(mode="json")
    assert resume._other_drivers(row(SIMULATED), SIMULATED) == ""
    document["drivers"]["fog"] |= {"distribution": "acme-fog", "version": "0.1"}
    del document["drivers"]["table"]
    changed = resume._other_drivers(replace(row(SIMULATED), bench=document), SIMULATED)
    now = f"{release.driver} of {release.distribution} {release.version}"
    assert changed == f"; driver of fog: {now} instead of {release.driver} of acme-fog 0.1"


def test_a_simulation_goes_on_as_it_was_begun() -> None:
    document = SIMULATED.model_dump(mode="json")
    document["simulation"] = {"seed": 5, "noise_seed": 3}
    begun = replace(row(SIMULATED), bench=document)
    found = resume.with_original_simulation(begun, SIMULATED)
    assert found.simulation is not None
    assert (found.simulation.seed, found.simulation.noise_seed) == (5, 3)
    assert resume.with_original_simulation(begun, REAL) == REAL
    document["simulation"] = None
    assert resume.with_original_simulation(begun, SIMULATED) == SIMULATED
    del document["simulation"]
    assert resume.with_original_simulation(begun, SIMULATED) == SIMULATED
    document["simulation"] = {"units": {"fog": 3}, "not_known": 1}  # the first of two errors is named
    said = r"campaign 7 was simulated by another version of labctl, .*: simulation\.units\.fog: Input should be a valid"
    with pytest.raises(Conflict, match=said):
        resume.with_original_simulation(begun, SIMULATED)


def test_a_plan_is_read_back_as_it_was_written_down() -> None:
    plan, _, _ = plan_for("short", "single-axis-sim", clip=False)
    steps = [SimpleNamespace(body=step.model_dump(mode="json")) for step in plan.steps]
    store: Any = SimpleNamespace(campaigns=SimpleNamespace(steps=lambda number: {7: steps}[number]))
    written = row(SIMULATED, recipe=plan.recipe.model_dump(mode="json"))
    assert resume.plan_of(store, written).steps == plan.steps
    assert resume.plan_of(store, written).recipe == plan.recipe


@pytest.mark.parametrize(
    ("bench", "speed", "ahead_s", "goes_on"),
    [
        (SIMULATED, None, -10.0, True),
        (SIMULATED, 5.0, -10.0, False),  # at the present time
        (SIMULATED, 5.0, 3600.0, True),  # never back
        (SIMULATED, None, 3600.0, True),
        (REAL, None, 3600.0, False),
    ],
)
def test_where_simulated_time_goes_on(bench: BenchFile, speed: float | None, ahead_s: float, goes_on: bool) -> None:
    last_at = SystemClock().utc() + timedelta(seconds=ahead_s)
    assert resume._simulated_start(bench, speed, last_at) == (last_at if goes_on else None)


def test_the_newest_campaign_that_is_not_over_is_the_first_of_them(world: World) -> None:
    with pytest.raises(Conflict, match="no campaign was interrupted; `labctl campaign resume ID` resumes one"):
        resume._newest_unfinished(world.store)
    world.unfinished = [row(SIMULATED), row(REAL)]
    assert resume._newest_unfinished(world.store) is world.unfinished[0]


@dataclass
class Here:
    """What `resume_here` goes through, in order."""

    world: World
    acts: list[Any] = field(default_factory=list)
    clocks: list[Any] = field(default_factory=list)
    control: Any = field(default_factory=Control)
    log: Any = None

    @contextmanager
    def block(self, name: str, value: Any) -> Iterator[Any]:
        self.acts.append(name)
        yield value
        self.acts.append(f"{name} closed")

    def recording(self, path: Path | None, bench: BenchFile, clock: Any, session: Any) -> Any:
        self.clocks.append(clock)
        result = SimpleNamespace(state=None, readings=None)
        self.log = None if path is None else SimpleNamespace(wire="wire", result=result)
        self.acts.append(("recording", path, bench.name, session.kind, session.campaign))
        return self.block("log", self.log)


@pytest.fixture
def here(world: World, monkeypatch: pytest.MonkeyPatch) -> Here:
    made = Here(world)
    world.unfinished = [world.row]
    answer = SimpleNamespace(id=7, state=CampaignState.DONE)
    stand_ins: dict[str, Any] = {
        "default_database": lambda: "the default",
        "open_store": lambda location, write: made.block(f"read {location} {write}", world.store),
        "open_for": lambda bench, location: made.block(f"open {location} for {bench.name}", world.store),
        "holding": lambda _store, _bench: made.block("hold", made.control),
        "SafeStateRetry": lambda *of: SimpleNamespace(attempt=lambda: made.acts.append(("safe", of[-1]))),
        "let_move": lambda _store, bench, by, at: made.acts.append(("let move", bench, by, at.tzinfo)),
        "recording": made.recording,
        "prepare_resume": lambda _store, number, bench, make, request, wire: made.acts.append(
            ("prepare", number, bench.name, make(POINT), request.by, wire)
        ) or "prepared",
        "run_attended": lambda _store, prepared, held, observe, attend, wire: made.acts.append(
            ("run", prepared, held is made.control, observe, attend, wire)
        ) or answer,
        "readings_digest": lambda _store, number: f"digest of {number}",
    }  # fmt: skip
    for name, stand_in in stand_ins.items():
        monkeypatch.setattr(resume, name, stand_in)
    return made


def test_a_campaign_is_resumed_on_a_bench_that_is_held_safe_and_allowed_to_move(here: Here) -> None:
    observe: Any = "observe"
    attend: Any = "attend"
    answer = resume.resume_here(None, None, None, None, ResumeRequest(by="Ada"), observe, attend)
    assert answer.id == 7
    safe = here.acts.pop(4)
    name, (clock,) = SIMULATED.name, here.clocks
    assert here.acts == [
        "read the default False", "read the default False closed", f"open the default for {name}", "hold",
        ("let move", name, "Ada", UTC),
        ("recording", None, name, "campaign resume", 7), "log",
        ("prepare", 7, name, clock, "Ada", None),
        ("run", "prepared", True, "observe", "attend", None),
        "log closed", "hold closed", f"open the default for {name} closed",
    ]  # fmt: skip
    assert safe[0] == "safe"
    assert safe[1]().utc() != clock.utc()  # a retry of the safe state has a clock of its own
    assert (clock.speed, clock.before_wait.args) == (math.inf, (here.control,))  # a stop ends its waits
    assert clock.utc() == POINT.last_at  # simulated time goes on where it was


def test_the_campaign_the_bench_and_the_database_that_are_named_are_those(here: Here) -> None:
    here.world.unfinished = []
    resume.resume_here("lab.sqlite", 7, "triaxial-sim", 50.0, ResumeRequest())
    assert here.acts[0] == "read lab.sqlite False"
    assert here.acts[2] == "open lab.sqlite for triaxial-sim"
    (clock,) = here.clocks
    assert clock.utc() > POINT.last_at  # with a speed simulated time goes on at the present
    assert (clock.speed, here.acts[4][1]().speed) == (50.0, 50.0)
    with pytest.raises(Conflict, match="no campaign was interrupted"):
        resume.resume_here(None, None, None, None, ResumeRequest())


def test_a_wire_log_ends_with_the_state_of_the_campaign_and_its_readings(here: Here, tmp_path: Path) -> None:
    resume.resume_here(None, 7, None, None, ResumeRequest(by="Ada"), wire_log=tmp_path / "log")
    assert (here.log.result.state, here.log.result.readings) == ("done", "digest of 7")
    assert ("prepare", 7, SIMULATED.name, here.clocks[0], "Ada", "wire") in here.acts
    assert ("run", "prepared", True, None, None, "wire") in here.acts
