"""`labctl bench new` against simulated instruments on real terminals and TCP ports, and the file that it writes."""

from __future__ import annotations

import io
import json
import os
import tomllib
import tty
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from instruments.bench_config import BenchFile, read_bench
from instruments.clock import ScaledClock, SystemClock
from instruments.discovery import find_on_port
from instruments.simulators.server import SimulationServer
from tests.helpers.lab import Lab

#: Of the simulated instruments and the clock that waits for them: at more, a busy machine loses readings.
SPEED = 1.0
TEMPLATE = "!1sp1,{divisor}"


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Lab:
    monkeypatch.setattr("labctl.services.benches.new_bench.SystemClock", lambda: ScaledClock(SPEED))
    return Lab(tmp_path)


def serve(record: dict[str, Any]) -> Iterator[tuple[SimulationServer, BenchFile, io.StringIO]]:
    heard = io.StringIO()
    server = SimulationServer(BenchFile.model_validate(record), ScaledClock(SPEED), heard)
    yield server, server.start(), heard
    server.stop()


@pytest.fixture
def far() -> Iterator[tuple[SimulationServer, BenchFile, io.StringIO]]:
    """The triaxial bench and a DSP-3000, on real ports: (server, bench with the real addresses, what each received)."""
    record = read_bench("triaxial-sim").model_dump(exclude_none=True)
    unit = record["gyros"][0] | {"serial": "N25582405002003"}
    fog = {"name": "fog", "driver": "kvh-dsp3000", "port": "sim://kvh-dsp3000/fog", "serial": "F1", "max_rate_dps": 375}
    record["gyros"] = [unit, fog]
    yield from serve(record)


@pytest.mark.slow
def test_it_finds_what_is_on_each_port_and_writes_a_file_that_passes_the_check(
    lab: Lab, far: tuple[SimulationServer, BenchFile, io.StringIO]
) -> None:
    _, bench, heard = far
    assert bench.table is not None
    assert bench.chamber is not None
    path = lab.folder / "my-bench.toml"
    ports = [option for each in (bench.table, *bench.gyros) for option in ("--port", str(each.port))]
    host = f"{bench.chamber.host}:{bench.chamber.tcp_port}"
    answers = ["kvh-dsp3000.serial=FOG-7", f"table.speed_template={TEMPLATE}", "table.max_rate_dps=450"]
    settings = [option for answer in answers for option in ("--set", answer)]
    command = ["bench", "new", str(path), *ports, "--host", host, "--latitude", "48.2", *settings]
    told = lab.json(*command)
    assert [(each["kind"], each["driver"]) for each in told["found"]] == [
        ("table", "arrick-c4"), ("gyro", "stim300"), ("gyro", "kvh-dsp3000"), ("chamber", "watlow-f4t"),
    ]  # fmt: skip
    written = tomllib.loads(path.read_text())
    assert written == told["bench"]
    assert (written["name"], written["latitude_deg"]) == ("my-bench", 48.2)
    assert (written["chamber"]["min_c"], written["chamber"]["max_c"]) == (-70.0, 150.0)
    assert [unit["serial"] for unit in written["gyros"]] == ["N25582405002003", "FOG-7"]
    assert written["gyros"][0]["sample_rate_hz"] == 125.0
    sent = [json.loads(line) for line in heard.getvalue().splitlines()]
    assert {line["heard"] for line in sent if line["device"] == "table"} == {"\r!1fp\r"}
    assert {line["heard"] for line in sent if line["device"] == "mems"} == {"C\rI\rT\r"}
    assert not any(line["table_turns"] for line in sent)
    assert {line["heard"] for line in sent if line["device"] == "fog"} == {"RRR"}  # once it is known who is there
    checked = lab.json("bench", "check", str(path))
    assert checked["ok"], checked
    assert lab.run(*command, "--yes", status=2).stderr.startswith(f"labctl: {path} exists already and was not changed")


@pytest.mark.slow
def test_what_is_missing_is_named_and_nothing_is_written(
    lab: Lab, far: tuple[SimulationServer, BenchFile, io.StringIO]
) -> None:
    _, bench, _ = far
    path = lab.folder / "my-bench.toml"
    port = str(bench.gyros[1].port)
    said = lab.run("bench", "new", str(path), "--port", port, "--yes", status=2).stderr
    assert "gyros.0.serial: Field required; give it with --set SECTION.KEY=VALUE" in said
    assert not path.exists()
    said = lab.run("bench", "new", str(path), "--port", str(bench.table and bench.table.port), "--yes", status=2).stderr
    assert "no gyro was recognised, and a bench needs one" in said
    said = lab.run("bench", "new", str(path), "--port", port, "--set", "nose.serial=1", "--yes", status=2).stderr
    assert "--set nose.serial: the bench file has no such section; choose one of kvh-dsp3000" in said


def test_a_chamber_on_a_serial_line_and_another_kind_of_lines_are_recognised() -> None:
    record = read_bench("single-axis-sim").model_dump(exclude_none=True)
    made = serve(record)
    _, bench, heard = next(made)
    try:
        assert bench.chamber is not None
        chamber = find_on_port(str(bench.chamber.port), ScaledClock(SPEED))
        fog = find_on_port(str(bench.gyros[0].port), ScaledClock(SPEED))
        assert (chamber.driver, fog.driver) == ("watlow-f4", "kvh-rd2100")
        assert {json.loads(line)["device"] for line in heard.getvalue().splitlines()} == {"chamber"}
    finally:
        next(made, None)


def test_a_port_on_which_something_unknown_comes_gets_no_byte() -> None:
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    os.set_blocking(ours, False)

    class Talking(SystemClock):
        """Something comes at each look."""

        def sleep(self, duration_s: float) -> None:
            os.write(ours, b"$GPGGA,1,2*55\r\n")
            super().sleep(duration_s / 20)

    found = find_on_port(os.ttyname(theirs), Talking())
    assert found.driver == ""
    assert "bytes arrived that no driver recognises, so labctl sent nothing" in found.why_not
    with pytest.raises(BlockingIOError):
        os.read(ours, 1)
    os.close(ours)
    os.close(theirs)


def test_questions_are_asked_with_what_was_found(
    lab: Lab, far: tuple[SimulationServer, BenchFile, io.StringIO], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[str, str]] = []

    def answer(text: str, default: str) -> str:
        asked.append((text, default))
        return "FOG-9"

    monkeypatch.setattr("labctl.cli.commands.bench.is_terminal", lambda: True)
    monkeypatch.setattr("typer.prompt", answer)
    path = lab.folder / "my-bench.toml"
    told = lab.run("bench", "new", str(path), "--port", str(far[1].gyros[1].port)).stdout
    assert asked == [("kvh-dsp3000.serial: the unit's serial number, from its label", "")]
    assert tomllib.loads(path.read_text())["gyros"][0]["serial"] == "FOG-9"
    assert "KVH DSP-3000  [kvh-dsp3000]" in told
    assert f"{path} is written; check it: labctl bench check {path}" in told.replace("\n", "")


def test_ports_are_listed_with_the_name_for_a_bench_file(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    class Port:
        device, product, serial_number, location = "/dev/null", "FT232R", "A9", "1-1"

        def __lt__(self, other: object) -> bool:
            return False

    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [Port()])
    monkeypatch.setattr("instruments.discovery.stable_name", lambda _: "/dev/serial/by-id/usb-A9")
    monkeypatch.setattr("instruments.discovery.users_of", lambda _: ["process 8 (minicom)"])
    (port,) = lab.json("bench", "ports")
    assert port == {
        "device": "/dev/null", "path": "/dev/serial/by-id/usb-A9", "adapter": "A9", "product": "FT232R",
        "trouble": "process 8 (minicom) has the port open: end that process",
    }  # fmt: skip
    assert (
        "/dev/serial/by-id/usb-A9  now /dev/null; USB adapter A9 (FT232R); process 8"
        in lab.run("bench", "ports").stdout
    )
