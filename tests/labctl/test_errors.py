"""Errors travel between processes: whatever their constructors take, they come out as they went in."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from typing import Any

import pytest

from instruments import errors as of_instruments
from instruments.transport.modbus_link import RefusedRegister
from labctl.errors import DataRefused, LabctlError, StoreError, TooBusy
from labctl.fitting.models.inversion import NotConverged
from labctl.service_connection import ServiceRefused
from procedures.contracts import errors as of_procedures


def kinds(root: type[Exception]) -> Iterator[type[Exception]]:
    yield root
    for kind in root.__subclasses__():
        yield from kinds(kind)


ROOTS = (LabctlError, of_instruments.InstrumentError, of_procedures.ProcedureError)
ALL = sorted({kind for root in ROOTS for kind in kinds(root)}, key=lambda kind: kind.__name__)
ARGUMENTS: dict[type[Exception], tuple[Any, ...]] = {
    DataRefused: ("text", [{"said": "so"}]),
    TooBusy: ("text", 7),
    RefusedRegister: ("device", "text", 2),
    of_procedures.PlanRefused: ("recipe", ["one", "two"], "do this"),
    of_procedures.BadData: ("gyro", "text"),
    of_procedures.NoReadings: ("gyro", "text"),
    of_procedures.NotFollowing: ("gyro", "text"),
    of_procedures.GuardTripped: ("kind", "action", "text", "device"),
    of_procedures.StepFailed: ("text", {"far": 1.0}),
}


def example(kind: type[Exception]) -> Exception:
    usual = ("device", "text") if issubclass(kind, of_instruments.InstrumentError) else ("text",)
    return kind(*ARGUMENTS.get(kind, usual))


@pytest.mark.parametrize("kind", ALL, ids=lambda kind: kind.__name__)
def test_every_error_is_the_same_in_another_process(kind: type[Exception]) -> None:
    error = example(kind)
    error.__dict__["exit_status"] = 7
    found = pickle.loads(pickle.dumps(error))
    assert (type(found), str(found), found.args, found.__dict__) == (kind, str(error), error.args, error.__dict__)


def test_all_kinds_were_looked_at() -> None:
    assert {NotConverged, ServiceRefused, of_procedures.GuardTripped, of_instruments.NoReply} <= set(ALL)
    text = pickle.loads(pickle.dumps(StoreError("text", cause="cause")))
    assert text.cause == "cause"
