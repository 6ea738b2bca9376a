"""The check of a bench: what is found of each instrument, and one right line for each thing that is wrong."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from instruments.bench_config import BenchFile, read_bench
from instruments.checks import ports as port_checks
from instruments.checks.check import check
from instruments.checks.findings import DeviceReport
from instruments.clock import VirtualClock
from instruments.drivers.resolution import resolve
from instruments.simulation import open_simulation
from labctl.cli.printing.benches import print_check
from labctl.services.benches.check import response_of
from tests.helpers.spoilt_bench import F4, check_spoilt, terminals

#: What the check of the spoilt bench says, device by device; {0} stands for the device's port.
EXPECTED = {
    "table": "port {0} may not be used by this user: run `sudo usermod -aG GROUP $USER`, then log in again",
    "chamber": "a profile is running or held on the controller, so a set point would have no "
    "effect; end the profile at the panel of the controller",
    "gone": "port {0} does not exist: plug the adapter in, or give the present name of the port; "
    "`labctl bench ports` lists all ports",
    "held": "port {0} cannot be opened (Resource temporarily unavailable); check which other process has it open: run "
    "`fuser -v {0}`, and end that process",
    "angle": "the unit on {0} is not configured as the bench file requires: the gyro output unit is "
    "INCREMENTAL ANGLE in deg instead of ANGULAR RATE or AVERAGE ANGULAR RATE; configure the unit "
    "in its service mode (commands u, m, d), or correct the bench file",
    "moved": "port {0} is on USB adapter B2, but the bench file or the campaign names A1; two "
    "adapters may be exchanged: "
    "give the "
    "path of the port in /dev/serial/by-id",
    "mute": "no intact datagram on {0} within 1.5 s: no bytes arrived; check that the program at the "
    "other end of this pseudo-terminal runs and is not held up by other programs, and bit rate 460800, datagram 0x94 "
    "and crlf",
    "fast": "sends 110 readings/s on {0}, but the bench file says 100, limit +-4 %; set sample_rate_hz = 110 or "
    "configure "
    "the unit",
}

GROUP = re.compile(r"-aG \w+")  #: the group that a pseudo-terminal has depends on the system


def named(reports: list[DeviceReport]) -> dict[str, DeviceReport]:
    return {report.device: report for report in reports}


def figures(report: DeviceReport) -> dict[str, float | None]:
    return {finding.what: finding.value for finding in report.findings}


def test_eight_things_wrong_are_eight_right_lines(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with terminals(monkeypatch) as ports:
        bench, reports = check_spoilt(ports)
    bad = {r.device: [GROUP.sub("-aG GROUP", f.text) for f in r.findings if f.state == "bad"] for r in reports}
    assert bad == {r.device: [EXPECTED[r.device].format(r.address)] for r in reports}
    print_check(response_of(bench, "spoilt", reports))
    lines = capsys.readouterr().out.splitlines()
    assert len([line for line in lines if line.startswith("failed ")]) == 8
    assert re.fullmatch(r"spoilt at \d{4}-\d\d-\d\d \d\d:\d\d:\d\d UTC: 8 wrong, 0 doubtful", lines[-1])


def test_what_a_technician_needs_is_found_on_the_triaxial_bench() -> None:
    bench = resolve(read_bench("triaxial-sim"))
    found = named(check(bench, VirtualClock()))
    assert [report.is_ok for report in found.values()] == [True] * 3
    chamber = figures(found["chamber"])
    assert chamber["air temperature"] == pytest.approx(25.0, abs=0.1)
    assert chamber["set point"] == 25.0
    assert {"alarms", "control", "limits", "identity"} <= set(chamber)
    unit = figures(found["mems"])
    assert unit["readings"] == pytest.approx(125.0, rel=1e-4)
    assert unit["counter"] == 16.0
    assert abs(unit["clock"] or 0.0) < 5.0
    assert found["mems"].reported["serial"].startswith("N")
    assert "u = 0" in next(f.text for f in found["mems"].findings if f.what == "clock")


def test_the_drift_of_a_clock_is_measured() -> None:
    record = read_bench("triaxial-sim").model_dump()
    record["simulation"]["units"] = {"mems": {"sample_clock_ppm": 250.0}}
    found = named(check(resolve(BenchFile.model_validate(record)), VirtualClock()))
    assert figures(found["mems"])["clock"] == pytest.approx(250.0, abs=5.0)


def chamber_of(**state: Any) -> DeviceReport:
    """Return the check of an F4 whose simulator is in a state."""
    bench, clock = resolve(read_bench("single-axis-sim")), VirtualClock()
    simulation = open_simulation(bench, clock)
    device: Any = simulation.device(F4)
    for name, value in state.items():
        setattr(device._device, name, value)
    if alarm := state.get("alarm_words_at"):
        device._device.alarm_words[alarm] = 1
    return named(check(bench, clock, simulation))["chamber"]


def test_a_sensor_break_an_alarm_and_a_manual_mode_are_each_a_line() -> None:
    broken = chamber_of(sensor_code=-32000, mode=2, profile=0)
    assert [f.text for f in broken.findings if f.state == "bad"] == [
        (
            "air temperature (register 100) reads -32000 counts; this value is the code of a sensor "
            "break: check the sensor and its wires at the controller"
        ),
        (
            "the controller is in manual mode, so a set point would have no effect; set the controller "
            "to auto at its panel"
        ),
    ]
    alarm = chamber_of(alarm_words_at=1)
    assert [f.text for f in alarm.findings if f.state == "bad"] == [
        "the chamber reports: alarm 1 high; remove the cause at the chamber, then clear it at the controller's panel"
    ]


def test_a_turning_table_and_one_without_a_speed_command_are_told() -> None:
    record = read_bench("single-axis-sim").model_dump(exclude_none=True)
    del record["table"]["speed_template"]
    bench, clock = resolve(BenchFile.model_validate(record)), VirtualClock()
    simulation = open_simulation(bench, clock)
    table = named(check(bench, clock, simulation))["table"]
    assert [f.text for f in table.findings if f.state == "bad"] == [
        (
            "no constant rate: the C4's speed command is not public; set speed_template of the table in the bench file "
            "from "
            "your controller's manual"
        )
    ]
    simulation.world.table.start(clock.now_s(), 16_000, 100.0, 90.0)
    table = named(check(bench, clock, simulation))["table"]
    assert "the table is turning: stop it, and find out which program or person drives it" in table.text


def test_a_check_moves_nothing_and_sets_nothing() -> None:
    bench, clock = resolve(read_bench("single-axis-sim")), VirtualClock()
    simulation = open_simulation(bench, clock)
    device: Any = simulation.device(F4)
    check(bench, clock, simulation)
    assert device._device.writes == []
    assert np.ptp(simulation.world.table.angle_deg(np.linspace(0.0, clock.now_s(), 100))) == 0.0


def test_one_port_under_two_names_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with terminals(monkeypatch) as ports:
        other = tmp_path / "by-id"
        other.symlink_to(ports.mute)
        found = port_checks.shared({"table": ports.mute, "fog": str(other), "mems": ports.moved})
        assert {name: each.text for name, each in found.items()} == {
            "fog": f"port {other} is also given for table ({ports.mute}): give each instrument a different port"
        }


def test_an_open_port_is_judged_by_name_adapter_users_and_latency(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, timer = tmp_path / "by-id", tmp_path / "sys" / "ttyUSB7" / "device" / "latency_timer"
    folder.mkdir()
    timer.parent.mkdir(parents=True)
    timer.write_text("16\n")
    port = tmp_path / "ttyUSB7"
    port.write_text("")
    (folder / "usb-FTDI_A9-if00-port0").symlink_to(port)
    monkeypatch.setattr("instruments.transport.port_failures.BY_ID", folder)
    monkeypatch.setattr("instruments.transport.latency.SYS_TTY", tmp_path / "sys")
    monkeypatch.setattr(port_checks, "adapter_of", lambda _: "A9")
    monkeypatch.setattr(port_checks, "users_of", lambda _: ["process 812 (ModemManager)"])
    found = port_checks.of_open_port(str(port), wants_quick=True)
    assert [(each.what, each.state) for each in found] == [
        ("port", "good"), ("port name", "doubtful"), ("port users", "doubtful"), ("latency timer", "doubtful"),
    ]  # fmt: skip
    assert found[0].text == f"port {port} on USB adapter A9"
    assert found[1].text.endswith(f"set port = '{folder}/usb-FTDI_A9-if00-port0'")
    assert found[2].text.startswith("process 812 (ModemManager) also has ")
    assert found[3].text == (f"the adapter delays received bytes by up to 16 ms: run `echo 1 | sudo tee {timer}`")
    by_id = port_checks.of_open_port(str(folder / "usb-FTDI_A9-if00-port0"), wants_quick=False)
    assert [each.state for each in by_id] == ["good", "doubtful", "good"]
    assert "(ttyUSB7) on USB adapter A9" in by_id[0].text
