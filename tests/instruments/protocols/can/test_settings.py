"""What a bench file says of a gyro on a CAN bus: what is refused, and with which words."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from instruments.bench_config import read_bench
from instruments.drivers.can_bus import TRIAL
from instruments.protocols.can.settings import CanSettings
from instruments.protocols.can.units import unit_of_text
from instruments.protocols.stream_formats.units import UNITS
from tests.helpers.paths import ROOT

GIVEN = {"driver": "can", "name": "imu", "serial": "C-1", "max_rate_dps": 300, **TRIAL}


def settings(**changes: Any) -> CanSettings:
    return CanSettings.model_validate({key: value for key, value in {**GIVEN, **changes}.items() if value is not None})


def test_axes_and_scales_follow_from_the_signals() -> None:
    found = settings()
    assert found.axes == ("x", "y", "z")
    scales = found.layout().scales
    assert scales["gyro_x"] == ("deg/s", 0.001, 0.0)
    assert scales["gyro_z"] == ("deg/s", 0.02, -655.36)
    assert scales["accel_z_g"].scale == pytest.approx(2.0**-40 / 9.80665)
    assert scales["temperature_c"] == ("deg C", 0.01, 0.0)
    in_radians = settings(units={"gyro_x": "rad/s"}).layout().scales["gyro_x"]
    assert in_radians.scale == pytest.approx(0.0572957795)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"port": "/dev/ttyUSB0"}, "'/dev/ttyUSB0' is no address of a CAN bus; write can://INTERFACE/CHANNEL"),
        ({"port": None}, "port is missing; add the bus"),
        ({"sample_rate_hz": None}, "sample_rate_hz is missing; add the number of cycles per second"),
        ({"dbc": "imu.dbc"}, "the folder of the bench file has no file 'imu.dbc'"),
        ({"dbc": "nonsense"}, r"the DBC text cannot be read \(.*line 1, column 1"),
        ({"dbc": "x" * (1 << 20)}, "the DBC text has 1048576 characters, the limit is 524288; keep only"),
        ({"hold": [], "signals": {"gyro_z": "Rate.RateZ"}}, "DBC file has no message 'Rate'; did you mean 'Rates'"),
        ({"hold": [], "signals": {"gyro_z": "Rates.RateXX"}}, "Rates has no signal 'RateXX'; did you mean 'RateX'"),
        ({"hold": [], "signals": {"gyro_z": "Rates"}}, "message Rates has no signal ''; choose one of RateX; RateY;"),
        ({"hold": [], "axes": ["x"], "signals": {"gyro_z": "Rates.RateX"}}, "signals has no gyro_x; add gyro_x ="),
        ({"units": {"gyro_x": "furlong"}}, "channel gyro_x: units gives 'furlong', which is no unit of this quantity"),
        ({"units": {"gyro_x": "deg C"}}, r"units = \{ gyro_x = 'deg/s' \}, by one of 'deg/s', 'mdeg/s', 'deg/h'"),
        ({"units": {"rate": "deg/s"}}, "units names 'rate', but signals has no such channel"),
        ({"hold": ["humidity"]}, "hold names 'humidity', but signals has no such channel"),
        ({"hold": ["gyro_x"]}, "hold names gyro_x, but a rate must come in every cycle"),
        ({"first": None}, r"several messages \(Rates \(0x1A0\), RateAndForce \(0x1A1\)\); name a signal of the"),
        ({"first": "Housekeeping.Temperature"}, "its message holds no channel that comes in every cycle"),
        ({"status": {"Rates.State": "Ok"}}, "no value 'Ok' \\(it has 'Starting', 'Valid', 'Fault'\\)"),
        ({"status": {"RateAndForce.ForceZ": 1}}, "is a floating-point number; name a signal of whole numbers"),
        ({"counter": "Rates.RateX"}, "counter 'Rates.RateX' is no unsigned whole number"),
        ({"counter": ["Rates.Count", "Rates.State"]}, r"counter: its signals have \[2, 4\] bits"),
        ({"start": ["go"]}, "'go' is not a CAN frame"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused(changes: dict[str, Any], text: str) -> None:
    with pytest.raises(ValidationError, match=text):
        settings(**changes)


def test_a_message_of_can_fd_is_refused() -> None:
    long = 'BO_ 1 Long: 12 X\n SG_ Rate : 64|16@1- (1,0) [0|0] "deg/s" X\n'
    dbc = f'VERSION ""\n\nBU_: X\n\n{long}\nBA_DEF_ BO_ "VFrameFormat" ENUM "a";\n'
    with pytest.raises(
        ValidationError, match="message Long has 12 bytes, but a frame of classical CAN holds at most 8"
    ):
        settings(dbc=dbc, signals={"gyro_z": "Long.Rate"}, hold=[], counter=None, first=None, status={})


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252", "utf-8-sig"])
def test_a_bench_file_names_a_dbc_file_beside_it(tmp_path: Path, encoding: str) -> None:
    """Its text is then part of the bench file, which a campaign keeps."""
    dbc = str(TRIAL["dbc"]).replace('"deg/s"', '"°/s"').replace('"degC"', '"°C"')
    (tmp_path / "unit.dbc").write_bytes(dbc.replace("\n", "\r\n").encode(encoding))
    (tmp_path / "bench.toml").write_text(
        'name = "own"\n[[gyros]]\nname = "imu"\ndriver = "can"\nport = "can://socketcan/can0"\ndbc = "unit.dbc"\n'
        'serial = "C-1"\nmax_rate_dps = 300\nsample_rate_hz = 100\nfirst = "Rates.Count"\n'
        'signals = { gyro_x = "Rates.RateX", gyro_z = "RateAndForce.RateZ" }\n',
        encoding="utf-8",
    )
    (gyro,) = read_bench(tmp_path / "bench.toml").gyros
    assert gyro.model_dump()["dbc"] == dbc
    found = CanSettings.model_validate(gyro.model_dump(exclude_unset=True))
    assert found.layout().scales["gyro_x"].unit == "deg/s"


@pytest.mark.parametrize(
    ("spelling", "unit"),
    [("°/s", "deg/s"), ("Deg / Sec", "deg/s"), ("dps", "deg/s"), ("rad/s", "rad/s"), ("m/s^2", "m/s2"),
     ("m/s²", "m/s2"),
     ("degC", "deg C"), ("°C", "deg C"), ("mV", "mV"), ("deg/h", "deg/h"), ("", ""), ("rpm", None), ("%", None)],
)  # fmt: skip
def test_units_as_dbc_files_spell_them(spelling: str, unit: str | None) -> None:
    assert unit_of_text(spelling) == unit
    assert unit is None or unit in UNITS


def test_the_example_of_the_documentation_is_one() -> None:
    page = (ROOT / "docs" / "how-to" / "can.md").read_text(encoding="utf-8")
    (section,) = tomllib.loads(page.partition("```toml\n")[2].partition("```")[0])["gyros"]
    assert section["dbc"] == "imu.dbc"
    found = CanSettings.model_validate({**section, "dbc": TRIAL["dbc"]})
    assert found.axes == ("x", "y", "z")
    assert found.signals == TRIAL["signals"]
