"""A live calibration against known truth: it asks for poses until it is complete, and U falls meanwhile."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np
import pytest

from labctl.errors import BadInput
from labctl.fitting import fit
from labctl.fitting.live import LiveCalibration, LiveState, Target
from labctl.recording import RecordingInfo
from tests.helpers.turned_unit import TurnedUnit

INFO = RecordingInfo(
    serial="HAND-1", axes=("x", "y", "z"), kind="samples", motion="poses", started_at=datetime(2026, 1, 5, tzinfo=UTC)
)
MAX_BLOCKS = 400


@dataclass(frozen=True)
class Run:
    """A calibration to its end."""

    unit: TurnedUnit
    live: LiveCalibration
    states: list[LiveState]


def run(seed: int, target: Target) -> Run:
    unit, live, states = TurnedUnit(seed), LiveCalibration(INFO, target), list[LiveState]()
    for _ in range(MAX_BLOCKS):
        live.add(unit.block(0.5))
        states.append(live.assess())
        if states[-1].done:
            break
        unit.see(states[-1].request)
    return Run(unit, live, states)


@pytest.fixture(scope="module")
def whole() -> Run:
    return run(1, Target(u=1.5e-3, poses=18))


def test_the_poses_that_are_asked_for_make_it_complete(whole: Run) -> None:
    last = whole.states[-1]
    assert last.done
    assert last.missing == ()
    assert last.request is None
    assert len(last.covered) == last.wanted == 18
    assert last.rests < 26  # an asked pose is a pose more: few turns are in vain


def test_u_falls_and_the_truth_is_inside(whole: Run) -> None:
    largest = [state.worst.expanded for state in whole.states if state.worst is not None]
    assert len(set(largest)) >= 5
    assert largest[-1] < 0.8 * largest[0]
    changes = np.diff(largest)
    assert np.sum(changes[changes > 0]) < 0.5 * -np.sum(changes[changes < 0])
    assert largest[-1] <= 1.5e-3
    errors = []
    for each in whole.states[-1].coefficients:
        if each.limit is None:
            continue
        i = "xyz".index(each.axis)
        j = i if each.name == "scale_factor" else "xyz".index(each.name[-1])
        errors.append((each.value - whole.unit.gyro[i, j]) / each.expanded)
    assert len(errors) == 9
    assert np.mean(np.abs(errors) <= 1) >= 8 / 9
    assert np.max(np.abs(errors)) < 1.5


@pytest.mark.parametrize("seed", [2, 3])
def test_the_truth_is_inside_u_of_other_units(seed: int) -> None:
    found = run(seed, Target(u=2e-3, poses=12))
    assert found.states[-1].done
    for each in found.states[-1].coefficients:
        if each.name == "scale_factor":
            i = "xyz".index(each.axis)
            assert abs(each.value - found.unit.gyro[i, i]) < 2 * each.expanded


def test_what_is_shown_is_the_fit_of_the_recording(whole: Run) -> None:
    shown = whole.live.assess(finally_=True)
    fitted = fit(whole.live.recording, "poses")
    for axis, found in fitted.fitted.axes.items():
        mine = [each for each in shown.coefficients if each.axis == axis]
        assert [each.value for each in mine] == found.values[:, 0].tolist()
        assert [each.expanded for each in mine] == (2 * found.u[:, 0]).tolist()


def test_before_the_first_rest_it_asks_for_a_pose_and_says_what_is_missing() -> None:
    live, unit = LiveCalibration(INFO), TurnedUnit(1)
    live.add(unit.block(0.2))
    state = live.assess()
    assert state.request is not None
    assert state.request.text == (
        "turn the unit until it lies with body axis z pointing up, and leave it at rest for 2 s"
    )
    assert state.missing[0].startswith("18 of 18 poses are missing, by the axes that point up: z; -z;")
    assert not state.done
    live.add(unit.block(2.0))
    resting = live.assess()
    assert resting.still_s == pytest.approx(2.2, abs=0.05)
    assert resting.rests == 1


def test_a_limit_of_the_bias_is_asked_for_too(whole: Run) -> None:
    strict = LiveCalibration(INFO, Target(u=1.5e-3, bias_dps=1e-6))
    strict.add({name: values for name, values in whole.live.recording.columns.items() if name != "dataset"})
    state = strict.assess()
    assert not state.done
    assert state.turns_left is not None
    assert state.turns_left > 100
    assert any(text.startswith("U of bias of x is ") and "above its limit of 1e-06 (deg/s)" in text
               for text in state.missing)  # fmt: skip
    assert state.request is not None


def test_a_turn_that_cannot_be_used_is_said_with_the_reason(whole: Run) -> None:
    columns = {name: values for name, values in whole.live.recording.columns.items() if name != "dataset"}
    rate = np.asarray(columns["gyro_x"], dtype=np.float64)
    largest = float(np.abs(rate).max())
    columns["gyro_x"] = np.clip(rate, -0.9 * largest, 0.9 * largest)
    live = LiveCalibration(INFO, Target(u=1.5e-3))
    live.add(columns)
    state = live.assess()
    assert state.left_out
    saturated = [text for text in state.left_out if "s is not used: gyro_x is saturated at " in text]
    assert saturated
    assert saturated[0].startswith("the turn from ")
    assert saturated[0].endswith("deg/s: turn the unit more slowly")
    assert whole.states[-1].left_out == ()


def test_specific_force_in_another_unit_is_said(whole: Run) -> None:
    wrong = LiveCalibration(INFO)
    columns = {name: values for name, values in whole.live.recording.columns.items() if name != "dataset"}
    for axis in "xyz":
        columns[f"accel_{axis}_g"] = 9.80665 * np.asarray(columns[f"accel_{axis}_g"], dtype=np.float64)
    wrong.add(columns)
    state = wrong.assess()
    assert state.coefficients == ()
    assert state.missing[-1].startswith(
        "the specific force at rest is 9.82 g where gravity is 1 g: check unit and scale"
    )


def test_readings_that_cannot_be_used_are_refused() -> None:
    unit, live = TurnedUnit(1), LiveCalibration(INFO)
    block = unit.block(0.1)
    with pytest.raises(BadInput, match="HAND-1: the stream has no accel_z_g; add rates and specific forces"):
        live.add({name: values for name, values in block.items() if name != "accel_z_g"})
    live.add(block, lost=2)
    with pytest.raises(BadInput, match=r"HAND-1: t_s does not rise after 0\.09"):
        live.add(block)
    with pytest.raises(BadInput, match="other columns than those before it"):
        live.add({**unit.block(0.1), "supply_v": np.zeros(10)})
    live.add_unread(damaged=3)
    assert (len(live), live.assess().lost, live.assess().damaged) == (10, 2, 3)
    with pytest.raises(BadInput, match="give kind = 'samples' and motion = 'poses'"):
        LiveCalibration(INFO.model_copy(update={"motion": "rates"}))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"u": 0.0}, "--target 0: an uncertainty must be above 0"),
        ({"bias_dps": float("nan")}, "--target-bias nan"),
        ({"poses": 11}, "--poses 11: give 12 to 26"),
        ({"poses": 27}, "--poses 27: give 12 to 26"),
        ({"rest_s": 0.5}, "--rest 0.5 s: give 1 to 60 s"),
    ],
)
def test_a_target_outside_of_its_range_is_refused(wrong: dict[str, float], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        Target(**wrong)  # type: ignore[arg-type]
