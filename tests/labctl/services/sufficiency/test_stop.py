"""A campaign that ends when U of its fit is small enough: on the simulated bench, from recipe to draft."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from instruments.clock import VirtualClock
from labctl.answers.campaigns import CampaignResponse, ResumeRequest, StartRequest
from labctl.answers.drafts import DraftsRequest
from labctl.calibration import read_calibration
from labctl.errors import BadInput
from labctl.services.benches.stop_rules import check_stop_on
from labctl.services.calibrations.uncertainty import uncertainty_of
from labctl.services.campaigns.execution import run, run_here
from labctl.services.campaigns.preparation import prepare
from labctl.services.campaigns.resume import prepare_resume
from labctl.services.campaigns.status import campaign_status
from labctl.services.drafts.make import make_drafts
from labctl.services.planning.fit_rules import check_fit
from labctl.services.planning.loading import load_bench
from labctl.services.planning.plan_answer import describe_plan
from labctl.services.sufficiency.answers import uncertainty_course, with_target
from labctl.services.sufficiency.evaluation import Evaluation, UnitU
from labctl.services.sufficiency.in_process import InOwnProcess
from labctl.services.sufficiency.monitor import InThisThread, UncertaintyMonitor
from labctl.services.sufficiency.texts import missing_text, reached_text
from labctl.store import Store, open_store
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.control import Control
from procedures.contracts.errors import PlanRefused
from procedures.monitoring.progress import Progress
from procedures.recipe.recipe import parse_recipe

BENCH = "single-axis-sim"


def recipe(u_dps: float, fitted: str = "ojeda2000", **stop: str) -> str:
    """Return a recipe that comes to its highest temperature half-way, and goes back through those between."""
    more = "".join(f"{key} = {value}\n" for key, value in stop.items())
    return f"""format = "labctl-recipe/1"
name = "until-enough"
temperatures_c = [22, 24, 26, 28, 30, 32, 34]
rates_dps = [-60, -20, 0, 20, 60]
positions = ["z"]
temperature_order = "up_down"
rate_order = "random"
[soak]
hold_s = 120
max_drift_c = 1.0
drift_window_s = 60
[acquire]
duration_s = 10
settle_s = 2
[fit]
model = "{fitted}"
criticise = false
[stop]
u_dps = {u_dps}
{more}"""


def run_once(location: Path, text: str) -> CampaignResponse:
    return run_here(str(location), StartRequest(recipe=text, bench=BENCH))


@pytest.fixture(scope="module")
def ended(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a database with a campaign that has ended early."""
    location = tmp_path_factory.mktemp("enough") / "lab.sqlite"
    assert run_once(location, recipe(0.0085)).state is CampaignState.DONE
    return location


@pytest.fixture
def store(ended: Path, tmp_path: Path) -> Iterator[Store]:
    for part in ended.parent.iterdir():
        shutil.copy(part, tmp_path)
    with open_store(str(tmp_path / ended.name), write=True) as opened:
        yield opened


@pytest.mark.slow
def test_it_is_done_before_its_plan_and_says_why(store: Store) -> None:
    status = campaign_status(store, 1)
    course = uncertainty_course(store, 1).units["fog"]
    assert status.reason.startswith("U 0.0")
    assert f"reached the target 0.0085 deg/s after {course.datasets[-1]} of 35 data sets" in status.reason
    assert "steps were skipped, because they are not needed" in status.reason
    steps = store.campaigns.steps(1)
    states = [step.state for step in steps if step.kind == "acquire"]
    assert states == ["done"] * course.datasets[-1] + ["skipped"] * (35 - course.datasets[-1])
    assert course.datasets[-1] < 35
    measured = {step.body.get("temperature_c") for step in steps if step.kind == "acquire" and step.state == "done"}
    assert {22.0, 34.0} <= measured


def test_its_u_is_that_of_the_calibration_that_is_fitted_afterwards(store: Store) -> None:
    found = Evaluation(store, 1).evaluate(is_last=True)[0]
    make_drafts(store, 1, DraftsRequest(), store.campaigns.get(1).ended_at)  # type: ignore[arg-type]
    document, _ = store.calibrations.document("FOG-0001", 1)
    stated = uncertainty_of(read_calibration(document), found.rate_dps, found.temperature_c)[found.axis]
    assert found.u_dps == pytest.approx(stated.expanded_dps, rel=1e-12)
    assert uncertainty_course(store, 1).units["fog"].u_dps[-1] == found.u_dps


def test_the_status_and_the_course_say_how_far_it_is(store: Store) -> None:
    status = with_target(store, campaign_status(store, 1))
    assert status.target is not None
    assert (status.target.u_dps, status.target.model) == (0.0085, "ojeda2000")
    assert (status.target.rates_dps, status.target.temperature_c) == ([-60, 60], [22, 34])
    (unit,) = status.target.units
    assert (unit.gyro, unit.known) == ("fog", "of the fit")
    assert unit.u_dps is not None
    assert unit.u_dps <= 0.0085
    answer = uncertainty_course(store, 1)
    course = answer.units["fog"]
    assert (answer.target_u_dps, answer.planned) == (0.0085, 35)
    assert course.datasets == sorted(course.datasets)
    first_whole = course.known.index("of the fit")
    assert {"at least", "unknown"} >= set(course.known[:first_whole])
    reached = [u <= 0.0085 for u, known in zip(course.u_dps, course.known, strict=True) if known == "of the fit" and u]
    assert reached[-1]


@pytest.mark.slow
def test_another_process_finds_the_same_from_the_database(store: Store) -> None:
    here = InThisThread(store, 1).last()
    other = InOwnProcess(store.location, 1)
    try:
        assert list(other.last()) == list(here)
        assert other.newest() == []  # asked for now; the answer is there at a later data set
    finally:
        other.close()


def test_a_process_that_has_died_ends_no_campaign(store: Store) -> None:
    other = InOwnProcess(store.location, 1)
    assert other._process is not None
    other._process.kill()
    other._process.wait()
    monitor = UncertaintyMonitor(other, 35, 0.0085)
    found = [monitor.ask(), monitor.ask(), monitor.conclude("")]
    assert [each.enough for each in found] == ["", "", ""]
    assert [event.kind for each in found for event in each.events] == ["uncertainty_not_computed"]
    monitor.close()


def test_a_process_that_cannot_be_started_ends_no_campaign(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(11, "no more processes")

    monkeypatch.setattr(subprocess, "Popen", refuse)
    monitor = UncertaintyMonitor(InOwnProcess(store.location, 1), 35, 0.0085)
    assert [event.kind for event in (*monitor.ask().events, *monitor.ask().events)] == ["uncertainty_not_computed"]
    assert monitor.conclude("").enough == ""
    monitor.close()


@pytest.mark.slow
def test_a_model_that_is_wrong_does_not_end_a_campaign_however_much_is_measured(tmp_path: Path) -> None:
    answer = run_once(tmp_path / "lab.sqlite", recipe(0.03, "weiss1995"))
    assert answer.state is CampaignState.DONE
    assert "is above the target 0.03 deg/s; more data sets there would not bring it to the target" in answer.reason
    assert "what the model leaves" in answer.reason
    assert "all steps done" in answer.reason


@pytest.mark.slow
def test_after_an_interruption_the_same_state_is_rebuilt_from_the_database(store: Store, tmp_path: Path) -> None:
    whole = campaign_status(store, 1).reason
    text = recipe(0.0085, repeatability="false")  # a simulated bench ends with its process: two powered runs
    with open_store(str(tmp_path / "again.sqlite"), write=True) as other:
        bench = load_bench(BENCH)
        prepared, control = prepare(other, text, bench, VirtualClock(), clip=False), Control()

        def seen(progress: Progress) -> None:
            if "data set 12 of" in progress.step_text:
                control.interrupt("the process ends")

        assert run(other, prepared, control, seen).state is CampaignState.INTERRUPTED
        before = uncertainty_course(other, 1).units["fog"]
        request = ResumeRequest(by="Ada")
        answer = run(other, prepare_resume(other, 1, bench, lambda point: VirtualClock(point.last_at), request))
        after = uncertainty_course(other, 1).units["fog"]
    assert answer.state is CampaignState.DONE
    assert "reached the target 0.0085 deg/s" in answer.reason, (answer.reason, whole)
    assert after.datasets[: len(before.datasets)] == before.datasets
    assert after.datasets == sorted(after.datasets)
    assert after.datasets[-1] < 35


@pytest.mark.parametrize(
    ("u_dps", "stop", "text"),
    [
        (0.001, {}, "U is at least .* mostly by repeatability"),
        (1e-5, {"repeatability": "false"}, "cannot be reached by unit FOG-0001: U is at least .* mostly by clock"),
    ],
)
def test_a_target_that_the_bench_cannot_reach_is_refused_with_the_figure(
    u_dps: float, stop: dict[str, str], text: str
) -> None:
    with pytest.raises(PlanRefused, match=text):
        describe_plan(recipe(u_dps, **stop), BENCH, clip=False, check=check_stop_on)
    describe_plan(recipe(0.03, **stop), BENCH, clip=False, check=check_stop_on)


def test_a_range_with_a_place_that_is_not_near_any_data_set_is_refused() -> None:
    sparse = recipe(0.0085).replace("[-60, -20, 0, 20, 60]", "[-60, 0, 60]")
    with pytest.raises(PlanRefused, match="about z stays unknown: at -30 deg/s and 22 deg C no data set was measured"):
        describe_plan(sparse, BENCH, clip=False, check=check_stop_on)


def test_a_campaign_that_cannot_reach_its_target_does_not_begin(tmp_path: Path) -> None:
    with pytest.raises(PlanRefused, match=r"stop.u_dps = 0.001 deg/s cannot be reached"):
        run_once(tmp_path / "lab.sqlite", recipe(0.001))
    with pytest.raises(BadInput, match=r"\[stop\]: .*ojeda2001"):
        check_fit(parse_recipe(recipe(0.01, "weiss1995", model='"ojeda2001"')))


UNIT = UnitU("fog", 30, "of the fit", 0.0041, "z", 400.0, -40.0)


@pytest.mark.parametrize(
    ("unit", "text"),
    [
        (
            replace(UNIT, more_sets=12),
            (
                "U 0.0041 deg/s at -40.0 deg C and 400 deg/s about z is above the target 0.003 deg/s; about 12 more "
                "data sets there would bring it to the target"
            ),
        ),
        (
            replace(UNIT, model_share=0.1),
            (
                "U 0.0041 deg/s at -40.0 deg C and 400 deg/s about z is above the target 0.003 deg/s; more data sets "
                "there would not bring it to the target, because the rest is standards of the bench, repeatability "
                "and what the model leaves"
            ),
        ),
        (
            replace(UNIT, known="at least", why="50 deg C was not measured with y up yet"),
            "U is at least 0.0041 deg/s: 50 deg C was not measured with y up yet",
        ),
        (
            replace(UNIT, known="unknown", u_dps=None, axis="", why="the model needs 3 temperatures"),
            "U is not known: the model needs 3 temperatures; the target 0.003 deg/s was not reached",
        ),
        (
            replace(UNIT, u_dps=0.002, why="the model may be wrong"),
            (
                "U 0.002 deg/s at -40.0 deg C and 400 deg/s about z is within the target 0.003 deg/s, but the model "
                "may be wrong"
            ),
        ),
    ],
)
def test_what_is_missing_is_said_in_words(unit: UnitU, text: str) -> None:
    assert missing_text([unit], 0.003) == text
    assert reached_text([unit], 40, 0.003) == ""


def test_every_unit_has_to_reach_the_target() -> None:
    reached = replace(UNIT, u_dps=0.0029)
    assert reached_text([reached], 40, 0.003).startswith("U 0.0029 deg/s reached the target 0.003 deg/s after 30 of 40")
    assert reached_text([reached, replace(UNIT, gyro="imu")], 40, 0.003) == ""
    assert missing_text([reached, replace(UNIT, gyro="imu")], 0.003).startswith("U of imu 0.0041 deg/s at")
    assert reached_text([], 40, 0.003) == ""
