"""An act on a campaign is declared once: its route, its commands and the call of another process follow from that."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from inspect import signature
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import APIRouter
from fastapi.testclient import TestClient
from typer._click.core import Context
from typer.cli import get_docs_for_click
from typer.main import get_command
from typer.testing import CliRunner

from instruments.clock import VirtualClock
from labctl.answers.campaigns import CampaignRequest, CampaignResponse, ConfirmRequest, ReasonRequest, ResumeRequest
from labctl.api import create_app
from labctl.api.act_routes import add_act_route
from labctl.cli.app import app
from labctl.client import Client
from labctl.errors import Conflict
from labctl.processes.bench_rpc import BENCH_ACTS
from labctl.service_connection import ServiceRefused
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.status import campaign_status
from labctl.services.campaigns.unattended import not_running
from labctl.services.commands.acts import catalogue
from labctl.services.commands.acts.campaign_act import CampaignAct
from labctl.services.commands.acts.campaign_command import CampaignCommand
from labctl.services.commands.acts.catalogue import CAMPAIGN_ACTS
from labctl.services.commands.acts.confirm import CONFIRM
from labctl.services.commands.acts.resume import RESUME
from labctl.services.commands.context import CommandContext, Foreground, ServiceBench
from labctl.services.commands.requests import CampaignResume, ToCampaign
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import load_bench
from labctl.store import Store, open_store
from tests.helpers.openapi import openapi_document

Asked = ToCampaign[ReasonRequest]


def _linger_in_service(control: ServiceBench, context: CommandContext, request: Asked) -> CampaignResponse:
    control.bench_runner()
    control.record(context, LINGER.name, request.campaign, request.body.text)
    return campaign_status(context.store, request.campaign)


def _linger_in_foreground(_: Foreground, context: CommandContext, request: Asked) -> CampaignResponse:
    raise not_running(context.store, request.campaign, "let it linger")


#: Nothing but this makes an act.
LINGER = CampaignAct(
    name="linger",
    body=ReasonRequest,
    request_type=Asked,
    summary="Hold the temperature",
    description="Stay in the present soak.",
    command_line=CampaignCommand(
        help="Stay in the present soak until the campaign is resumed.",
        defaults={"reason": "held from the command line"},
    ),
    in_service=_linger_in_service,
    in_foreground=_linger_in_foreground,
    is_urgent=True,
)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


@pytest.mark.slow
def test_a_declared_act_has_a_route_whose_request_is_validated_and_an_entry_in_the_audit_trail(store: Store) -> None:
    runner = BenchRunner(store, load_bench("single-axis-sim"), VirtualClock)
    campaign = runner.start(CampaignRequest(recipe="short")).id
    service = create_app(LabService(store, VirtualClock(), runner))
    router = APIRouter(prefix="/api/campaigns")
    add_act_route(router, LINGER)
    service.include_router(router)
    with TestClient(service) as client:
        described = service.openapi()["paths"]["/api/campaigns/{campaign}/linger"]["post"]
        assert described["summary"] == "Hold the temperature"
        answer = client.post(f"/api/campaigns/{campaign}/linger", json={"reason": "the door is open", "by": "Ada"})
        assert (answer.status_code, answer.json()["id"]) == (200, campaign)
        assert client.post(f"/api/campaigns/{campaign}/linger", json={"by": "Ada"}).status_code == 422
        held = [row for row in store.audit.rows() if row.action == "campaign linger"]
        assert [row.detail["reason"] for row in held] == ["the door is open (Ada)"]


@pytest.fixture
def with_linger(monkeypatch: pytest.MonkeyPatch) -> None:
    """Add the line of the catalogue."""
    monkeypatch.setattr(catalogue, "CAMPAIGN_ACTS", (*CAMPAIGN_ACTS, LINGER))


@pytest.mark.usefixtures("with_linger")
def test_a_declared_act_has_a_command_with_an_option_for_each_field_of_its_request(tmp_path: Path) -> None:
    database = str(tmp_path / "lab.sqlite")
    shown = CliRunner().invoke(app, ["campaign", "linger", "--help"], env={"COLUMNS": "200"})
    assert all(
        text in shown.stdout for text in ("until the campaign is resumed", "--reason", "--by", "--json", "--database")
    )
    asked = ["campaign", "linger", "7", "--by", "Ada", "--database", database]
    refused = CliRunner().invoke(app, asked)
    assert (refused.exit_code, "campaign 7 is not in this database" in refused.stderr) == (2, True), refused.output
    empty = CliRunner().invoke(app, [*asked, "--reason", ""])
    assert (empty.exit_code, "--reason" in empty.stderr) == (2, True)


@pytest.fixture
def sent(monkeypatch: pytest.MonkeyPatch) -> list[tuple[object, ...]]:
    """What commands have carried out, which is refused: database, command and request."""
    received: list[tuple[object, ...]] = []

    def execute(database: str | None, command: object, asked: object, terminal: object) -> CampaignResponse:
        received.append((database, command, asked, terminal is not None))
        raise Conflict("it was sent; nothing more is to be done")

    monkeypatch.setattr("labctl.services.commands.open.execute", execute)
    return received


@pytest.mark.usefixtures("with_linger")
def test_the_command_of_an_act_sends_its_request(sent: list[tuple[object, ...]]) -> None:
    CliRunner().invoke(app, ["campaign", "linger", "7", "--by", "Ada", "--database", "lab.sqlite"])
    request = ReasonRequest(reason="held from the command line", by="Ada")
    assert sent == [("lab.sqlite", LINGER.command, ToCampaign(7, request), False)]


@pytest.mark.parametrize(
    ("options", "answer"),
    [
        ([], {"confirmed": True, "again": False, "reason": ""}),
        (["--decline", "no hand free"], {"confirmed": False, "again": False, "reason": "no hand free"}),
        (["--again"], {"confirmed": False, "again": True, "reason": ""}),
    ],
)
def test_the_options_of_a_command_become_the_request_as_its_act_states(
    sent: list[tuple[object, ...]], options: list[str], answer: dict[str, Any]
) -> None:
    CliRunner().invoke(app, ["campaign", "confirm", "q1", "--campaign", "7", "--by", "Ada", *options])
    assert sent == [(None, CONFIRM.command, ToCampaign(7, ConfirmRequest(prompt="q1", by="Ada", **answer)), False)]


def test_two_answers_to_one_question_are_refused_before_anything_is_sent(sent: list[tuple[object, ...]]) -> None:
    both = ["campaign", "confirm", "q1", "--campaign", "7", "--again", "--decline", "no hand free"]
    refused = CliRunner().invoke(app, both)
    assert (refused.exit_code, "give one of them" in refused.stderr, sent) == (2, True, [])


def test_an_option_that_is_no_field_of_the_request_goes_into_its_address(sent: list[tuple[object, ...]]) -> None:
    CliRunner().invoke(app, ["campaign", "resume", "7", "--by", "Ada", "--power", "kept", "--speed", "2"])
    request = ResumeRequest(by="Ada", power="kept")
    assert sent == [(None, RESUME.command, CampaignResume(7, request, speed=2.0), True)]


@pytest.mark.usefixtures("with_linger")
def test_the_reference_of_the_command_line_has_a_declared_act() -> None:
    written = get_docs_for_click(obj=get_command(app), ctx=Context(get_command(app)), name="labctl")
    entry = written.partition("### `labctl campaign linger`")[2].partition("### ")[0]
    assert "* `--reason TEXT`: Reason for this action; it is recorded.  [default: held from the command line]" in entry
    assert written.index("`labctl campaign linger`") < written.index("### `labctl campaign abort`")


def test_every_act_has_a_command_that_is_made_or_written() -> None:
    group = get_command(app).commands["campaign"]  # type: ignore[attr-defined]
    names = group.list_commands(Context(group))
    assert [act.name for act in CAMPAIGN_ACTS if act.name not in names] == []
    assert len(names) == len(set(names))


def sent_by_client(act: CampaignAct[Any]) -> str:
    """Return how the client's method of an act differs from its declaration; empty: it does not."""
    method = getattr(Client, act.name, None)
    if method is None:
        return f"Client has no method {act.name}"
    given = {name: SAMPLES.get(name, f"the {name}") for name in act.body.model_fields}
    takes_request = "request" in signature(method).parameters
    parameters = {"request": act.body.model_validate(given)} if takes_request else given
    if set(signature(method).parameters) != {"self", "campaign", *parameters}:
        return f"Client.{act.name} takes {', '.join(signature(method).parameters)}; its request has {', '.join(given)}"
    sent: list[httpx.Request] = []

    def answer(request: httpx.Request) -> httpx.Response:
        sent.append(request)
        return httpx.Response(404, json={"title": "gone", "detail": "gone"})

    with Client(transport=httpx.MockTransport(answer)) as client, pytest.raises(ServiceRefused):
        getattr(client, act.name)(7, **parameters)
    (request,) = sent
    if (request.method, request.url.path) != (act.command.method, act.command.path.format(campaign=7)):
        return f"Client.{act.name} sends {request.method} {request.url.path}"
    body = act.body.model_validate_json(request.content).model_dump()
    return "" if body == given else f"Client.{act.name} sends {body} for {given}"


#: Values that are not any text.
SAMPLES = {"confirmed": True, "again": False, "power": "lost"}


def test_the_client_has_a_method_for_each_act_that_sends_its_request() -> None:
    assert [found for act in CAMPAIGN_ACTS if (found := sent_by_client(act))] == []
    assert sent_by_client(LINGER) == "Client has no method linger"
    other = replace(LINGER, name="pause", body=ConfirmRequest)
    assert sent_by_client(other).startswith("Client.pause takes self, campaign, reason, by; its request has prompt")


def test_every_act_of_the_catalogue_is_called_by_its_name_and_routed_as_it_says() -> None:
    paths = openapi_document()["paths"]
    for act in CAMPAIGN_ACTS:
        assert BENCH_ACTS[act.name] is act
        assert paths[f"/api/campaigns/{{campaign}}/{act.name}"]["post"]["summary"] == act.summary
