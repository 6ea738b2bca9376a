"""Commands: each stands once, and HTTP, the local executor and the routes follow from it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from instruments.clock import VirtualClock
from labctl.answers.calibrations import FitRequest, ImproveRequest
from labctl.answers.campaigns import CampaignRequest
from labctl.answers.schedule import ScheduledResponse
from labctl.api import create_app
from labctl.errors import BadRecording, Conflict
from labctl.service_connection import ServiceConnection, ServiceRefused
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.commands.acts.start import START_CAMPAIGN
from labctl.services.commands.encoding import json_body, recording_files
from labctl.services.commands.registry import COMMANDS, FIT, IMPORT_RECORDING, IMPROVE
from labctl.services.commands.remote import HttpExecutor
from labctl.services.commands.requests import CampaignStart, RecordingFolder, ToNewestOrVersion, ToStart, ToUnit
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import load_bench
from labctl.store import Store, open_store
from labctl.store.connection.database import Database
from tests.helpers.commands import local_executor
from tests.helpers.openapi import openapi_document
from tests.helpers.paths import EXAMPLES
from tests.helpers.service import transport_to


@pytest.fixture
def service(tmp_path: Path) -> Iterator[LabService]:
    store = Store(Database(str(tmp_path / "lab.sqlite"), write=True))
    made = LabService(store, VirtualClock(), BenchRunner(store, load_bench("single-axis-sim"), VirtualClock))
    yield made
    made.close()


def remote(service: LabService) -> HttpExecutor:
    """Return an executor whose requests reach the service without a port."""
    from fastapi.testclient import TestClient

    inside = TestClient(create_app(service))  # not entered: the service stays open
    return HttpExecutor(ServiceConnection("http://testserver", transport=transport_to(inside)))


def test_every_command_has_exactly_one_route_with_its_responses() -> None:
    described: Any = openapi_document()["paths"]
    assert len(COMMANDS) == 42
    assert len({(command.method, command.path) for command in COMMANDS}) == len(COMMANDS)
    for command in COMMANDS:
        responses = described[command.path][command.method.lower()]["responses"]
        assert {str(status) for status in command.responses} <= set(responses)
        for status, kind in command.responses.items():
            if status != 204:
                assert kind.__name__ in str(responses[str(status)])


@pytest.mark.slow
def test_here_in_the_service_and_over_http_a_command_answers_the_same(service: LabService, tmp_path: Path) -> None:
    asked = RecordingFolder(EXAMPLES / "osu-fog")
    request = ToUnit("OSU-FOG-2024", FitRequest(effects=["bias", "scale_factor"]))
    change = ToNewestOrVersion("OSU-FOG-2024", None, ImproveRequest(add=["scale_factor_asymmetry"]))
    far = remote(service)
    with open_store(str(tmp_path / "here.sqlite"), write=True) as store:
        here = local_executor(store, VirtualClock())
        assert here.execute(IMPORT_RECORDING, asked) == far.execute(IMPORT_RECORDING, asked)
        assert here.execute(FIT, request).model_dump(exclude={"hash"}) == far.execute(FIT, request).model_dump(
            exclude={"hash"}
        )
        improved = far.execute(IMPROVE, change)
        assert (improved.version, here.execute(IMPROVE, change).version) == (2, 2)
        assert service.execute(FIT, request).version == 3


def test_one_command_starts_a_campaign_now_or_later(service: LabService) -> None:
    later = CampaignStart(CampaignRequest(recipe="short", cron="30 2 * * MON", time_zone="UTC"))
    for executor in (service, remote(service)):
        entry = executor.execute(START_CAMPAIGN, later)
        assert isinstance(entry, ScheduledResponse)
        assert START_CAMPAIGN.status_of(entry) == 202
    now = remote(service).execute(START_CAMPAIGN, CampaignStart(CampaignRequest(recipe="short")))
    assert not isinstance(now, ScheduledResponse)
    assert START_CAMPAIGN.status_of(now) == 201


@pytest.mark.parametrize(("option", "value"), [("bench", "single-axis-sim"), ("speed", 2.0), ("seed", 3)])
def test_what_only_a_foreground_campaign_can_follow_is_refused_over_http(
    service: LabService, option: str, value: Any
) -> None:
    asked = CampaignStart(CampaignRequest(recipe="short"), **{option: value})
    with pytest.raises(Conflict, match=f"--{option} {value}: the service at http://testserver"):
        remote(service).execute(START_CAMPAIGN, asked)


def test_a_refusal_of_the_service_keeps_its_text_and_exit_status(service: LabService) -> None:
    with pytest.raises(ServiceRefused, match="unit 'X'") as refused:
        remote(service).execute(FIT, ToUnit("X", FitRequest()))
    assert refused.value.exit_status == 2


def test_only_what_was_set_is_sent() -> None:
    with ExitStack() as opened:
        assert json_body(opened, CampaignStart(CampaignRequest(recipe="short"))) == {"json": {"recipe": "short"}}
        assert json_body(opened, ToStart(1)) == {}


def test_a_folder_without_a_recording_is_not_sent(tmp_path: Path) -> None:
    with ExitStack() as opened, pytest.raises(BadRecording, match="no recording there"):
        recording_files(opened, RecordingFolder(tmp_path))
