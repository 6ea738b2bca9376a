"""A failed campaign in words, and whether it may be resumed: shown by the service, the API and the command line."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from instruments.clock import SystemClock, VirtualClock
from instruments.errors import NoReply
from labctl.api import create_app
from labctl.cli.printing.campaigns import print_campaign
from labctl.services.campaigns import preparation
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.failure_advice import DID_NOTHING, DID_SAFE, DID_UNSAFE, FAILURES, LOOK, OTHER, advice_of
from labctl.services.campaigns.status import campaign_status
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import limits_of, load_bench
from labctl.store import Store
from labctl.store.connection.database import Database
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.errors import BadData, SoakFailed, Unanswered
from procedures.contracts.journal import NOT_SAFE
from procedures.contracts.operator import HumanOperator
from procedures.monitoring.guards import CHECKS, Guards
from procedures.recipe.rules import GuardRules
from tests.helpers.guard_trips import TRIPS, WELL
from tests.helpers.waiting import wait_until


def happened(reason: str) -> str:
    answer = advice_of(CampaignState.FAILED, reason)
    assert answer is not None
    return answer.happened


@pytest.mark.parametrize(("kind", "change"), [(case[0], case[1]) for case in TRIPS])
def test_every_guard_has_its_own_advice(kind: str, change: dict[str, Any]) -> None:
    limits = limits_of(load_bench("triaxial-sim"))
    named = replace(limits, gyros={"imu": next(iter(limits.gyros.values()))})
    trips = [trip for trip in Guards(GuardRules(), named).check(replace(WELL, **change)) if trip.kind == kind]
    assert kind in CHECKS
    for trip in trips:
        assert happened(str(trip.error())) != OTHER.happened, trip.message


@pytest.mark.parametrize(
    ("reason", "word"),
    [
        (SoakFailed("the soak at 60 deg C did not settle within 7200 s: it drifts"), "did not settle"),
        (SoakFailed("chamber: 31.2 deg C after 7200 s, not within 0.5 deg C of 60 deg C; limit 7200 s"), "set point"),
        (Unanswered("no answer within 600 s to the request: turn the units"), "not answered in time"),
        (BadData("fog", "not one of about 500 readings came; check cable, power and baud rate"), "readings"),
        (NoReply("table", "/dev/ttyUSB0 gave no answer in 2.0 s; check power, cable and baud rate"), "did not answer"),
        (NoReply("imu", "no intact Xsens MTi reading on /dev/ttyUSB0 for 2.1 s: nothing came"), "did not answer"),
        (
            NoReply("imu", "cannot read air, text arrived (SSH-2.0) instead of a Modbus reply; check host"),
            "did not answer",
        ),
        (NoReply("imu", "the counter on /dev/ttyUSB0 stands at 7 in 50 readings in a row"), "readings"),
        (BadData("imu", "the sample counter on /dev/ttyUSB0 does not advance: it is 7 in 50 readings"), "readings"),
        ("Ann declined: turn the units: no wrench", "cannot be done"),
        ("resumed 5 times without finishing a step; inspect the bench", "never finished a step"),
        (
            "taken up 5 times without finishing a step; look at the bench",
            "never finished a step",
        ),  # of an older version of labctl
        ("not resumed: bench b was not confirmed safe: table to rest", "not confirmed safe"),
        ("ended by an error of the program", "fault in labctl itself"),
        ("ZeroDivisionError: division by zero", "fault in labctl itself"),
        ("something new", "could not be carried out"),
    ],
)
def test_a_reason_is_told_in_words(reason: object, word: str) -> None:
    assert word in happened(str(reason))


def test_every_sentence_is_short_and_says_what_to_do() -> None:
    for failure in (*FAILURES, OTHER):
        assert failure.happened.endswith(".")
        assert failure.next.endswith(".")
        assert len(failure.happened) < 100
        assert len(failure.next) < 160


def test_what_labctl_did_depends_on_the_safe_state() -> None:
    safe, unsafe, left = (
        advice_of(CampaignState.FAILED, reason)
        for reason in ("x", f"x. {NOT_SAFE}table to rest: it still moves", "not resumed: chamber: no answer")
    )
    assert safe is not None
    assert unsafe is not None
    assert left is not None
    assert (safe.done, unsafe.done, left.done) == (DID_SAFE, DID_UNSAFE, DID_NOTHING)
    assert unsafe.next == LOOK
    assert advice_of(CampaignState.DONE, "all steps done") is advice_of(CampaignState.ABORTED, "enough") is None


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(Database(str(tmp_path / "lab.sqlite"), write=True))


@pytest.fixture
def client(store: Store, monkeypatch: pytest.MonkeyPatch) -> Iterator[TestClient]:
    """A service on whose bench a person turns and switches the units."""
    monkeypatch.setattr(preparation, "operator_of", lambda _: HumanOperator())
    runner = BenchRunner(store, load_bench("single-axis-sim"), VirtualClock)
    with TestClient(create_app(LabService(store, SystemClock(), runner))) as opened:
        opened.post("/api/campaigns", json={"recipe": "short"})
        asked = wait_until(runner.listen, lambda: _campaign(opened), lambda answer: answer["prompt"])
        declined = {"prompt": asked["prompt"]["id"], "by": "Ann", "confirmed": False, "reason": "no wrench"}
        opened.post("/api/campaigns/1/confirm", json=declined)
        wait_until(runner.listen, lambda: runner.busy, lambda busy: not busy)
        yield opened


def _campaign(client: TestClient) -> dict[str, Any]:
    found: dict[str, Any] = client.get("/api/campaigns/1").json()
    return found


def test_api_and_command_line_tell_a_failure_in_words(
    client: TestClient, store: Store, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = _campaign(client)
    assert answer["state"] == "failed"
    assert answer["advice"]["happened"] == "A person answered that the requested action cannot be done."
    assert client.get("/api/campaigns").json()[0]["advice"] == answer["advice"]
    print_campaign(campaign_status(store, 1))
    reported = capsys.readouterr().out
    assert all(sentence in reported for sentence in answer["advice"].values())


def test_a_resume_that_would_be_refused_is_said_with_its_reason(client: TestClient, store: Store) -> None:
    assert (_campaign(client)["resumable"], _campaign(client)["resume_reason"]) == (True, "")
    store.benches.mark("single-axis-sim", "table to rest: it still moves", SystemClock().utc())
    refused = _campaign(client)
    assert refused["resumable"] is False
    assert "it still moves" in refused["resume_reason"]
    assert client.post("/api/campaigns/1/resume", json={"by": "Ann"}).status_code == 409
    client.post("/api/benches/single-axis-sim/clear", json={"by": "Ann"})
    assert _campaign(client)["resumable"] is True


def test_times_of_a_simulated_bench_are_marked(client: TestClient) -> None:
    assert _campaign(client)["simulated_time"] is True


def test_a_service_without_a_bench_resumes_nothing(client: TestClient, store: Store) -> None:
    answer = LabService(store, SystemClock()).status(1)
    assert answer.resumable is False
    assert "no bench" in answer.resume_reason
