"""Errors as data: each kind of the table comes out as it went in; what no table has comes out in words."""

from __future__ import annotations

import json
from typing import Any

import pytest

from instruments.errors import NoReply
from instruments.transport.modbus_link import RefusedRegister
from labctl.errors import DataRefused, LabctlError, NotEnoughData, StoreError, TooBusy
from labctl.fitting.models.inversion import NotConverged
from labctl.processes.documents import BadDocument, refusal, value_of
from labctl.processes.error_documents import KINDS, ErrorDocument, OtherProcessFailed
from labctl.processes.rpc_methods import supervisor_method
from procedures.contracts.errors import BadData, GuardTripped, PlanRefused, StepFailed

NOTHING = supervisor_method("address.give_back").result


def crossed(error: BaseException) -> Exception:
    with pytest.raises(Exception) as caught:  # noqa: PT011  of any kind
        value_of(NOTHING, refusal(error))
    return caught.value


MADE: tuple[Exception, ...] = (
    DataRefused("text", [{"said": "so"}]),
    TooBusy("text", 7),
    StoreError("text", cause="the disk"),
    NoReply("table", "no reply within 2 s"),
    PlanRefused("short", ["one", "two"], "Do this."),
    BadData("gyro", "text"),
    GuardTripped("overheat", "stop", "text", "chamber"),
    StepFailed("text", {"far": 1.0}),
    KeyError("name"),
    FileNotFoundError(2, "No such file or directory"),
)


@pytest.mark.parametrize("error", MADE, ids=lambda error: type(error).__name__)
def test_an_error_is_the_same_at_the_other_end(error: Exception) -> None:
    error.__dict__["exit_status"] = 7
    error.add_note("where it was")
    found = crossed(error)
    assert type(found) is type(error)
    assert (str(found), found.__notes__, vars(found)["exit_status"]) == (str(error), ["where it was"], 7)
    assert json.dumps(vars(found)) == json.dumps(vars(error))  # tuples are lists


@pytest.mark.parametrize("name", sorted(KINDS))
def test_every_kind_of_the_table_is_made_again(name: str) -> None:
    found = ErrorDocument(kind=name, args=["text; do this"]).error()
    assert type(found) is KINDS[name]
    assert "text; do this" in str(found)


def test_a_kind_beside_the_table_keeps_what_a_user_sees() -> None:
    found = crossed(NotConverged("the correction did not converge; fit again"))
    assert (type(found), str(found)) == (LabctlError, "the correction did not converge; fit again")
    assert isinstance(found, LabctlError)
    assert (found.slug, found.status) == (NotConverged.slug, NotConverged.status)
    assert type(crossed(RefusedRegister("device", "text", 2))).__name__ in KINDS


def test_an_error_of_the_program_arrives_with_its_traceback() -> None:
    with pytest.raises(ValueError, match="Expecting") as of_json:
        json.loads("{")
    assert type(crossed(of_json.value)) is ValueError  # JSONDecodeError is beside the table
    with pytest.raises(ZeroDivisionError) as raised:
        json.loads("1", parse_int=lambda _: 1 // 0)
    found = crossed(raised.value)
    assert (type(found), str(found)) == (OtherProcessFailed, f"ZeroDivisionError: {raised.value}")
    assert "test_error_documents.py" in found.__notes__[0]


HOSTILE: tuple[dict[str, Any], ...] = (
    {"kind": "SystemExit", "args": [0]},
    {"kind": "KeyboardInterrupt"},
    {"kind": "os.system", "args": ["true"]},
    {"kind": "__import__", "args": ["os"]},
)


@pytest.mark.parametrize("document", HOSTILE, ids=lambda document: str(document["kind"]))
def test_nothing_but_a_kind_of_the_table_is_made(document: dict[str, Any]) -> None:
    assert type(ErrorDocument.model_validate(document).error()) is OtherProcessFailed


def test_attributes_hide_no_method_and_no_property() -> None:
    sent = {"members": {"x": 1}, "with_traceback": 1, "__class__": "x", "__dict__": {}, "warnings": []}
    found = ErrorDocument(kind="DataRefused", args=["text"], attributes=sent).error()
    assert isinstance(found, DataRefused)
    assert (found.members, vars(found)) == ({"warnings": []}, {"warnings": []})


def test_an_error_with_more_than_is_declared_is_refused() -> None:
    with pytest.raises(BadDocument, match="the error of another process is not as expected at code"):
        value_of(NOTHING, b'raised\n[{"kind":"NotEnoughData","code":"x"}]')
    with pytest.raises(NotEnoughData):
        value_of(NOTHING, b'raised\n[{"kind":"NotEnoughData","args":["text"]}]')
