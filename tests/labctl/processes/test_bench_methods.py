"""Every call of the bench process: what is given and what is answered arrives as it was, of the type that it had."""

from __future__ import annotations

import inspect
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import pytest

from labctl.answers.benches import CheckRequest
from labctl.answers.campaigns import CampaignRequest, ConfirmRequest, ReasonRequest, ResumeRequest
from labctl.answers.live import LiveEndRequest, LiveRequest
from labctl.processes.bench_methods import Beat, method_of
from labctl.processes.documents import BadDocument, answer, value_of
from labctl.processes.rpc_methods import RpcMethod, read_call
from labctl.processes.settings import BenchSettings
from labctl.recording import RecordingInfo
from labctl.services.commands.acts.catalogue import BENCH_ACTS, CAMPAIGN_ACTS
from labctl.services.commands.requests import CampaignResume, CampaignStart, ToBench, ToCampaign
from labctl.store.store import transactions
from tests.helpers.example_values import PLAIN, examples

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
INFO = RecordingInfo(serial="LEFT-1", axes=("z",), kind="samples", started_at=AT)


def arrived(form: RpcMethod, **given: object) -> dict[str, object]:
    call, found = read_call(form.call(**given), method_of)
    assert (call.name, found) == (form.name, form)
    return dict(call.arguments)


def answered(form: RpcMethod, value: object) -> object:
    return value_of(form.result, answer(form.result, value))


def shown(value: object) -> str:
    """All of a value, numbers that are none included, with one name for the zone UTC."""
    return repr(value).replace("TzInfo(0)", repr(UTC))


@pytest.mark.parametrize("name", sorted(transactions()))
def test_every_transaction_gets_what_was_given(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PLAIN, RecordingInfo, (INFO,))
    hints = get_type_hints(inspect.unwrap(transactions()[name]), include_extras=True)
    form = method_of(f"store.{name}")
    for result in examples(hints.pop("return")):
        assert shown(answered(form, result)) == shown(result)
    values = {each: list(examples(kind)) for each, kind in hints.items()}
    for row in range(max(map(len, values.values()), default=0)):
        given = {each: found[row % len(found)] for each, found in values.items()}
        assert shown(arrived(form, **given)) == shown(given)


ASKED: dict[str, tuple[object, ...]] = {
    **{
        act.name: (act.request_type(1, ReasonRequest(reason="tea")),)
        for act in CAMPAIGN_ACTS
        if act.body is ReasonRequest
    },
    "start": (
        CampaignStart(CampaignRequest(recipe="short", checks=["table_free"]), simulated_start=AT, wire_log=Path("é")),
    ),
    "schedule": (CampaignStart(CampaignRequest(recipe="short"), "bench", 2.0, 7),),
    "resume": (CampaignResume(None, ResumeRequest(by="Ada")), CampaignResume(3, ResumeRequest(by="Ada", reason="on"))),
    "abort": (ToCampaign(1, ReasonRequest(reason='a "reason"')), ToCampaign(2**40, ReasonRequest(reason="x"))),
    "confirm": (ToCampaign(1, ConfirmRequest(prompt="2", confirmed=True, by="Ada")),),
    "check": (ToBench("a bench", CheckRequest()),),
    "start_live": (LiveRequest(serial="HG-1", latitude_deg=48.0, target_u=1e-4),),
    "end_live": (LiveEndRequest(),),
}


@pytest.mark.parametrize("name", BENCH_ACTS)
def test_every_act_gets_what_was_asked(name: str) -> None:
    for asked in ASKED[name]:
        found: Any = arrived(method_of(f"control.{name}"), request=asked)["request"]
        assert (type(found), found) == (type(asked), asked)
        body = getattr(asked, "body", asked)
        assert getattr(found, "body", found).model_fields_set == body.model_fields_set


def test_an_act_on_what_no_request_may_say_is_refused() -> None:
    form = method_of("control.start_live")
    document = form.call(LiveRequest(serial="HG-1")).replace(b"HG-1", b"../1")
    why = r"what call control\.start_live was given is not as expected at 0\.serial: .*; stop the service and start it"
    with pytest.raises(BadDocument, match=why):
        read_call(document, method_of)


def test_questions_and_what_a_supervisor_asks() -> None:
    for name in ("watch", "bench.describe", "bench.live_history", "address.give_back"):
        assert arrived(method_of(name)) == {}
    assert arrived(method_of("bench.live"), campaign=3) == {"campaign": 3}
    assert arrived(method_of("bench.live_state"), watched=True) == {"watched": True}
    assert answered(method_of("bench.live"), (True, None)) == (True, None)
    for beat in examples(Beat):
        assert answered(method_of("watch"), beat) == beat
    for wanted in examples(BenchSettings):
        assert shown(arrived(method_of("supervise"), wanted=wanted)["wanted"]) == shown(wanted)


def test_numbers_of_numpy_arrive_as_numbers() -> None:
    given = {"campaign": 1, "reason": "r", "at": AT, "state": "failed"}
    detail = {"n": np.int64(3), "u": np.float64(0.1), "ok": np.bool_(True)}
    found = arrived(method_of("store.Audit.record"), at=AT, action="a", subject="s", detail=detail)
    assert found["detail"] == {"n": 3, "u": 0.1, "ok": True}
    assert arrived(method_of("store.Campaigns.close_unfinished"), **given)["state"].value == "failed"  # type: ignore[attr-defined]
