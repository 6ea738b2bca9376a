"""The environment of the room: what is accepted, and what a certificate states of the time of its campaign."""

from __future__ import annotations

import json
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from instruments.clock import VirtualClock
from labctl.answers.calibrations import FitRequest
from labctl.answers.certificates import RoomConditions
from labctl.answers.validity import RoomEnvironmentRequest
from labctl.errors import BadInput
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.services.certificates.issue import issue
from labctl.services.certificates.served import certificate_file
from labctl.services.planning.loading import load_bench
from labctl.services.room_environment import add_readings, environment, of_campaign
from labctl.store import Store, open_store
from tests.helpers.certificates import SERIAL, request

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
BENCH = "single-axis-sim"


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    """A store with a campaign that has run, fitted and certified."""
    with open_store(str(tmp_path_factory.mktemp("room") / "lab.sqlite"), write=True) as store:
        run(store, prepare(store, "short", load_bench(BENCH), VirtualClock(), clip=False))
        fit_unit(store, SERIAL, FitRequest(effects=["bias", "scale_factor"]), AT)
        store.calibrations.certify(SERIAL, 1, "certify", by="Ada", reason="meets them", at=AT)
        yield store


def add(store: Store, at: datetime, bench: str = "", **values: tuple[float, str]) -> None:
    listed = [{"quantity": name, "value": value, "unit": unit} for name, (value, unit) in values.items()]
    body: dict[str, Any] = {"readings": [{"measured_at": at, "values": listed}], "source": "TH-3", "bench": bench}
    add_readings(store, RoomEnvironmentRequest.model_validate(body), AT + timedelta(days=9))


def stated(store: Store, **ordered: Any) -> dict[str, tuple[float, float, str]]:
    """Return the conditions of the room on the certificate, issued anew."""
    changed = request(conformity=None, environment=ordered or None)
    issue(
        store,
        SERIAL,
        1,
        changed.model_copy(update={"amend": "again"} if store.certificates.newest(SERIAL, 1) else {}),
        AT,
    )
    document = json.loads(certificate_file(store, SERIAL, 1, "json").content)
    return {
        each["name"]: (each["low"], each["high"], each["unit"])
        for each in document["environment"]
        if "room" in each["name"]
    }


def test_a_certificate_states_the_room_while_its_campaign_ran(measured: Store) -> None:
    typed = {"temperature_c": [20.0, 24.0], "pressure_hpa": [1000.0, 1020.0]}
    assert stated(measured) == {}
    assert stated(measured, **typed) == {
        "Temperature of the room": (20.0, 24.0, "°C"), "Air pressure of the room": (1000.0, 1020.0, "hPa"),
    }  # fmt: skip
    row = measured.campaigns.get(1)
    assert row.started_at is not None
    assert row.ended_at is not None
    for minutes, value in ((0, 21.0), (5, 22.5), (10, 21.5)):
        add(measured, row.started_at + timedelta(minutes=minutes), temperature=(value, "deg C"))
    add(measured, row.started_at - timedelta(seconds=1), temperature=(10.0, "deg C"))  # before
    add(measured, row.ended_at + timedelta(seconds=1), temperature=(40.0, "deg C"))  # after
    add(measured, row.started_at, bench="another", temperature=(5.0, "deg C"))
    add(measured, row.started_at, bench=BENCH, humidity=(44.0, "%"))
    assert {each.quantity: (each.low, each.high, each.readings) for each in of_campaign(measured, 1)} == {
        "temperature": (21.0, 22.5, 3), "humidity": (44.0, 44.0, 1),
    }  # fmt: skip
    assert stated(measured, **typed) == {
        "Temperature of the room": (21.0, 22.5, "°C"),  # recorded, so what was typed is not used
        "Relative humidity of the room": (44.0, 44.0, "%"),
        "Air pressure of the room": (1000.0, 1020.0, "hPa"),
    }
    xml = certificate_file(measured, SERIAL, 1, "xml").content.decode()
    assert r"\hecto\pascal" in xml
    assert "Relative humidity of the room" in xml


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"temperature": (21.0, "V")}, "the unit is not accepted; give deg C, K, deg F"),
        ({"temperature": (294.0, "deg C")}, "temperature 294 deg C is outside -40 to 60 deg C; correct the value"),
        ({"humidity": (140.0, "%")}, "is outside 0 to 100 %"),
        ({"pressure": (1.0, "kPa")}, "is outside 500 to 1200 hPa"),
    ],
)
def test_implausible_room_values_are_refused(tmp_path: Path, values: dict[str, tuple[float, str]], said: str) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        with pytest.raises(BadInput, match=said):
            add(store, AT, **values)
        with pytest.raises(BadInput, match="is a time to come"):
            add(store, AT + timedelta(days=10), temperature=(20.0, "deg C"))
        assert not environment(store, AT - timedelta(days=1), AT + timedelta(days=20)).readings


def test_other_units_are_converted(tmp_path: Path) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        add(store, AT, temperature=(71.6, "deg F"), pressure=(101325.0, "Pa"))
        found = {each.quantity: each.value for each in environment(store, AT, AT).readings}
        assert found == {"temperature": pytest.approx(22.0), "pressure": pytest.approx(1013.25)}


@pytest.mark.parametrize("span", [[24.0, 20.0], [float("nan"), 20.0], [20.0]])
def test_typed_conditions_are_least_then_largest(span: list[float]) -> None:
    with pytest.raises(ValidationError):
        RoomConditions.model_validate({"temperature_c": span})
