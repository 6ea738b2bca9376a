"""`labctl diagnose`, as it is typed: an ambiguous campaign, one experiment on the simulated bench, one name."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from labctl.answers.diagnosis import DiagnosisResponse, DiagnosisRound
from labctl.cli.commands.diagnosis import refuse_other_bench, waits_for_its_time
from labctl.errors import Conflict
from tests.helpers.lab import Lab

RECIPE = """name = "few-rates"
temperatures_c = [20, 26, 32]
rates_dps = [-90, -60, -30, 0, 30, 60, 90]
positions = ["z"]
[soak]
hold_s = 120
max_drift_c = 1.0
drift_window_s = 60
[acquire]
duration_s = 10
settle_s = 2
"""
#: All that the simulated unit has beside what is hidden in it.
MODEL = "bias,scale_factor,bias_temperature,scale_factor_temperature,sine_response,scale_factor_even"
UNIT = "FOG-0001"
TONIGHT = datetime(2099, 3, 28, 22, tzinfo=UTC)


@pytest.fixture(scope="module")
def ambiguous(tmp_path_factory: pytest.TempPathFactory) -> Lab:
    """Return a lab with a unit that has a dead band, which the rates of its campaign do not distinguish."""
    lab = Lab(tmp_path_factory.mktemp("diagnose"))
    (lab.folder / "few.toml").write_text(RECIPE)
    lab.run("campaign", "start", str(lab.folder / "few.toml"), "--hide", "dead_band=0.86")
    lab.run("fit", UNIT, "--effects", MODEL)
    return lab


@pytest.mark.slow
def test_one_experiment_names_the_cause(ambiguous: Lab, tmp_path: Path) -> None:
    lab = ambiguous.copy(tmp_path)
    output = lab.run("diagnose", UNIT, "--hours", "4").output
    named = "dead_band, scale_factor_odd, saturation, missed_steps"
    assert f"round 1, 0.0 h: ambiguous: {named} (dead_band 42 %, scale_factor_odd 25 %, " in output
    assert "next: more rates in the top third, at one temperature: 0.17 h on the bench" in output
    assert "if it is dead_band, this distinguishes it from scale_factor_odd, saturation, missed_steps" in output
    assert "round 2, 0.2 h: missing: dead_band" in output
    assert "One cause is left: dead_band, after 0.2 h on the bench." in output
    again = lab.json("diagnose", UNIT)  # begins with all recordings, and has nothing left to do
    assert (again["outcome"], again["recordings"], len(again["rounds"])) == ("one_cause", [1, 2], 1)
    assert lab.json("campaign", "list")[0]["recipe"] == "diagnosis-1-round-1"
    proposed = output.split("next: `labctl ")[-1].split("`")[0]
    assert proposed == f"improve {UNIT} --version 1 --recording 1,2 --add dead_band"
    improved = lab.json(*proposed.split())
    assert (improved["version"], improved["recordings"]) == (2, [1, 2])
    # the recording of an experiment alone is seven rates at one temperature: beside it are those it was made for
    judged = lab.json("criticise", UNIT)
    assert (judged["recordings"], judged["verdict"]) == ([1, 2], "adequate")
    assert lab.json("fit", UNIT, "--effects", MODEL)["recordings"] == [1, 2]
    lab.run("campaign", "start", str(lab.folder / "few.toml"), "--simulated-start", "2027-01-01T08:00:00Z")
    assert lab.json("criticise", UNIT, status=None)["recording"] == 3  # a campaign after the diagnosis stands alone


@pytest.mark.slow
def test_without_hours_for_an_experiment_nothing_runs(ambiguous: Lab, tmp_path: Path) -> None:
    lab = ambiguous.copy(tmp_path)
    answer = lab.json("diagnose", UNIT, "--hours", "0.1")
    assert (answer["outcome"], answer["spent_hours"]) == ("hours_spent", 0.0)
    assert len(lab.json("campaign", "list")) == 1
    assert "no open diagnosis" in lab.run("diagnose", UNIT, "--end", status=2).stderr


def test_a_diagnosis_for_later_needs_a_service(ambiguous: Lab, tmp_path: Path) -> None:
    lab = ambiguous.copy(tmp_path)
    refused = lab.run("diagnose", UNIT, "--at", "2099-01-01T22:00", status=2)
    assert "nothing begins a diagnosis later; start `labctl serve`, or leave the option out" in refused.stderr
    assert lab.json("campaign", "list")[0]["recipe"] == "few-rates"
    alone = lab.run("diagnose", UNIT, "--time-zone", "Europe/Berlin", status=2)
    assert "--time-zone Europe/Berlin: it is that of --at, which is not given; give both or neither" in alone.stderr


def scheduled(campaign: int | None = None, state: str = "measuring") -> DiagnosisResponse:
    """Return a diagnosis whose first experiment begins at TONIGHT."""
    first = DiagnosisRound.model_construct(number=1, campaign=campaign)
    return DiagnosisResponse.model_construct(
        id=3, serial=UNIT, bench="bench-a", state=state, begins_at=TONIGHT, rounds=[first]
    )


def test_a_diagnosis_for_later_is_not_followed_until_it_begins() -> None:
    before, after = TONIGHT - timedelta(hours=1), TONIGHT + timedelta(seconds=1)
    assert waits_for_its_time(scheduled(), before)
    assert not waits_for_its_time(scheduled(), after)
    assert not waits_for_its_time(scheduled(campaign=2), before)
    assert not waits_for_its_time(scheduled(state="judging"), before)


@pytest.mark.parametrize(("drives", "said"), [("bench-b", "drives bench-b"), ("", "drives no bench")])
def test_the_service_of_another_bench_is_not_waited_for(drives: str, said: str) -> None:
    with pytest.raises(Conflict, match=f"is on bench bench-a, but the service at http://x {said}; start the service"):
        refuse_other_bench(scheduled(), "http://x", drives)
    refuse_other_bench(scheduled(), "http://x", "bench-a")
