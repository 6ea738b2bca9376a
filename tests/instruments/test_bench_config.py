"""Bench files: what cannot be a bench is refused when it is read."""

from __future__ import annotations

import json
from typing import Any

import pytest
from pydantic import Field, ValidationError

from instruments.bench import checked_settings, open_bench
from instruments.bench_config import BenchFile, ChamberSettings, DriverRelease, read_bench
from instruments.clock import VirtualClock
from instruments.drivers.chambers.watlow_f4 import WatlowF4
from instruments.drivers.driver import ChamberDriver
from instruments.drivers.registry import DRIVERS
from tests.helpers.plugins import register


def two_units(**second: Any) -> dict[str, Any]:
    bench = read_bench("single-axis-sim").model_dump(exclude_none=True)
    (unit,) = bench["gyros"]
    other = {"name": "other", "serial": "FOG-0002", "port": "sim://other"}
    return {**bench, "gyros": [unit, {**unit, **other, **second}]}


def test_two_units_may_share_a_bench() -> None:
    assert len(BenchFile.model_validate(two_units()).gyros) == 2


@pytest.mark.parametrize("what", ["name", "serial", "port"])
def test_two_units_are_never_taken_for_one(what: str) -> None:
    same = two_units()["gyros"][0][what]
    with pytest.raises(ValidationError, match=f"two gyros have the {what} '{same}'; give each gyro a different one"):
        BenchFile.model_validate(two_units(**{what: same}))


@pytest.mark.parametrize(
    ("device", "place", "known"),
    [
        (
            "table",
            ("table", "driver"),
            "acutrol-3000 (labctl {version}), aerotech-ensemble (labctl {version}), arrick-c4",
        ),
        ("chamber", ("chamber", "driver"), "binder (labctl {version}), espec"),
        ("gyros", ("gyros", 0, "driver"), "can (labctl {version}), gyrostar (labctl {version}), kvh-dsp3000"),
    ],
)
def test_an_unknown_driver_is_refused_with_its_place_what_is_installed_and_what_to_do(
    device: str, place: tuple[str | int, ...], known: str
) -> None:
    bench = with_driver(device, "watlow-f5")
    for refused in (lambda: checked_settings(bench), lambda: open_bench(bench, VirtualClock())):
        with pytest.raises(ValidationError) as caught:
            refused()
        (error,) = caught.value.errors()
        assert (error["loc"], error["input"]) == (place, "watlow-f5")
        here = known.format(version=DRIVERS.plugin("stim300").version)
        assert error["msg"].startswith(f"no driver 'watlow-f5' is installed (installed: {here} (labctl ")
        assert "install the package that has it in its group labctl.drivers, or correct the name" in error["msg"]
        assert ("did you mean 'watlow-f4t'" in error["msg"] or "did you mean 'watlow-f4'" in error["msg"]) is (
            device == "chamber"
        )


def with_driver(device: str, name: str, **settings: Any) -> BenchFile:
    """Return a shipped bench with another driver, and other settings of it."""
    record = read_bench("single-axis-sim").model_dump()
    (record[device][0] if device == "gyros" else record[device]).update(driver=name, **settings)
    return BenchFile.model_validate(record)


def test_a_driver_of_another_kind_of_instrument_is_refused() -> None:
    with pytest.raises(
        ValidationError, match=r"driver 'stim300' is for a gyro, not for a chamber; choose binder, espec, "
    ):
        checked_settings(with_driver("chamber", "stim300"))


def test_a_driver_that_is_registered_needs_no_other_list(monkeypatch: pytest.MonkeyPatch) -> None:
    register(monkeypatch, DRIVERS, "watlow-f5", DRIVERS.get("watlow-f4"))
    bench = with_driver("chamber", "watlow-f5")
    resolved = checked_settings(bench)
    assert resolved.drivers["chamber"] == DriverRelease(driver="watlow-f5", distribution="acme-plugins", version="0.3")
    assert resolved.drivers["fog"].distribution == "labctl"
    assert checked_settings(resolved) == resolved, "a resolved bench resolves to itself"
    opened = open_bench(bench, VirtualClock())
    assert isinstance(opened.chamber, WatlowF4)
    opened.close()


#: What every chamber has.
KNOWN = "driver, port, host, tcp_port, adapter, min_c, max_c, safe_c, ramp_c_per_min, air_tau_s"


class HeaterSettings(ChamberSettings):
    """A chamber with a setting of its own, and another default than usual."""

    ramp_c_per_min: float = 3.0
    channel: int = Field(ge=1, le=4)


def heater(settings: HeaterSettings, ports: object, clock: object) -> Any:
    """Return no driver: only the settings are checked."""
    return settings


def heated(monkeypatch: pytest.MonkeyPatch, **settings: Any) -> BenchFile:
    """Return a bench with such a chamber."""
    register(monkeypatch, DRIVERS, "acme-heater", ChamberDriver(HeaterSettings, heater))
    record = read_bench("single-axis-sim").model_dump()
    record["chamber"] = {"driver": "acme-heater", "port": "sim://watlow-f4", **settings}
    return BenchFile.model_validate(record)


def test_settings_are_those_of_the_drivers_own_model(monkeypatch: pytest.MonkeyPatch) -> None:
    chamber = checked_settings(heated(monkeypatch, channel=2)).chamber
    assert isinstance(chamber, HeaterSettings)
    assert (chamber.channel, chamber.ramp_c_per_min, chamber.safe_c) == (2, 3.0, 25.0)


@pytest.mark.parametrize(
    ("settings", "place", "text"),
    [
        ({}, ("chamber", "channel"), "Field required"),
        ({"channel": 9}, ("chamber", "channel"), "Input should be less than or equal to 4"),
        (
            {"channel": 1, "chanel": 2},
            ("chamber", "chanel"),
            f"driver acme-heater has no such setting; choose one of {KNOWN}, channel",
        ),
    ],
)
def test_a_wrong_setting_is_refused_with_its_place(
    monkeypatch: pytest.MonkeyPatch, settings: dict[str, Any], place: tuple[str, ...], text: str
) -> None:
    with pytest.raises(ValidationError) as caught:
        checked_settings(heated(monkeypatch, **settings))
    (error,) = caught.value.errors()
    assert (error["loc"], error["msg"]) == (place, text)


def test_a_stored_bench_keeps_every_setting_and_release() -> None:
    resolved = checked_settings(read_bench("single-axis-sim"))
    record = json.loads(json.dumps(resolved.model_dump(mode="json")))
    assert record["table"]["step_clock_hz"] == 2e6, "a default of the driver's own"
    assert record["drivers"]["table"]["driver"] == "arrick-c4"
    assert checked_settings(BenchFile.model_validate(record)) == resolved


def test_a_simulated_gyro_whose_driver_has_no_profile_is_told_to_name_one(monkeypatch: pytest.MonkeyPatch) -> None:
    register(monkeypatch, DRIVERS, "kvh-new", DRIVERS.get("kvh-rd2100"))
    record = read_bench("single-axis-sim").model_dump()
    (gyro,) = record["gyros"]
    gyro |= {"driver": "kvh-new", "sample_rate_hz": None}
    with pytest.raises(ValueError, match="gyro driver 'kvh-new' has no profile of a simulated unit"):
        open_bench(BenchFile.model_validate(record), VirtualClock())
    record["simulation"]["units"] = {"fog": {"profile": "rd2100"}}
    with pytest.raises(ValueError, match="gyro driver 'kvh-new' has no default number of readings per second"):
        open_bench(BenchFile.model_validate(record), VirtualClock())
    gyro["sample_rate_hz"] = 10.0
    opened = open_bench(BenchFile.model_validate(record), VirtualClock())
    assert list(opened.gyros) == ["fog"]
    opened.close()


def test_a_table_holds_as_many_units_as_it_has_places() -> None:
    bench = two_units()
    table = bench["table"]
    assert BenchFile.model_validate(bench).units_at_once == 2
    assert BenchFile.model_validate({**bench, "table": {**table, "places": 3}}).units_at_once == 3
    with pytest.raises(ValidationError, match=r"table.places = 1, but the file has 2 units in \[\[gyros\]\]; correct"):
        BenchFile.model_validate({**bench, "table": {**table, "places": 1}})


def test_a_tilted_fixture_is_stated_by_its_directions() -> None:
    bench = read_bench("single-axis-sim").model_dump(exclude_none=True)
    stated = BenchFile.model_validate({**bench, "tilted_positions": ["z+x", "-x-y-z"]})
    assert stated.tilted_positions == ("x+z", "-x-y-z")
    for wrong in ("x", "x+y@90", "up"):
        with pytest.raises(ValidationError, match=r"is no direction of a tilted fixture|is not a position"):
            BenchFile.model_validate({**bench, "tilted_positions": [wrong]})
