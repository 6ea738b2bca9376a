"""An act on a campaign is declared once: its route, its command and the call of another process follow from that."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi import APIRouter
from fastapi.testclient import TestClient

from instruments.clock import VirtualClock
from labctl.answers.campaigns import CampaignRequest, CampaignResponse, ReasonRequest
from labctl.api import create_app
from labctl.api.act_routes import add_act_route
from labctl.processes.bench_calls import BENCH_ACTS
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.status import campaign_status
from labctl.services.campaigns.unattended import not_running
from labctl.services.commands.acts.campaign_act import CampaignAct
from labctl.services.commands.acts.catalogue import CAMPAIGN_ACTS
from labctl.services.commands.context import CommandContext, Foreground, ServiceBench
from labctl.services.commands.requests import ToCampaign
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import load_bench
from labctl.store import Store, open_store

Asked = ToCampaign[ReasonRequest]


def _hold_in_service(control: ServiceBench, context: CommandContext, asked: Asked) -> CampaignResponse:
    control.bench_runner()
    control.record(context, HOLD.name, asked.campaign, asked.body.text)
    return campaign_status(context.store, asked.campaign)


def _hold_in_foreground(_: Foreground, context: CommandContext, asked: Asked) -> CampaignResponse:
    raise not_running(context.store, asked.campaign, "hold it")


#: Nothing but this makes an act.
HOLD = CampaignAct(
    name="hold",
    body=ReasonRequest,
    summary="Hold the temperature",
    description="Stay in the present soak.",
    in_service=_hold_in_service,
    in_foreground=_hold_in_foreground,
    is_urgent=True,
)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


def test_a_declared_act_has_a_route_whose_request_is_validated_and_an_entry_in_the_audit_trail(store: Store) -> None:
    runner = BenchRunner(store, load_bench("single-axis-sim"), VirtualClock)
    campaign = runner.start(CampaignRequest(recipe="short")).id
    app = create_app(LabService(store, VirtualClock(), runner))
    router = APIRouter(prefix="/api/campaigns")
    add_act_route(router, HOLD)
    app.include_router(router)
    with TestClient(app) as client:
        assert app.openapi()["paths"]["/api/campaigns/{campaign}/hold"]["post"]["summary"] == "Hold the temperature"
        answer = client.post(f"/api/campaigns/{campaign}/hold", json={"reason": "the door is open", "by": "Ada"})
        assert (answer.status_code, answer.json()["id"]) == (200, campaign)
        assert client.post(f"/api/campaigns/{campaign}/hold", json={"by": "Ada"}).status_code == 422
        held = [row for row in store.audit.rows() if row.action == "campaign hold"]
        assert [row.detail["reason"] for row in held] == ["the door is open (Ada)"]


def test_every_act_of_the_catalogue_is_called_by_its_name_and_routed_as_it_says() -> None:
    paths = create_app(None).openapi()["paths"]  # type: ignore[arg-type]
    for act in CAMPAIGN_ACTS:
        assert BENCH_ACTS[act.name] is act
        assert paths[f"/api/campaigns/{{campaign}}/{act.name}"]["post"]["summary"] == act.summary
