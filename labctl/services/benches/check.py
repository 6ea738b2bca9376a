"""Benches: which there are, whether their instruments answer, and simulated ones on real ports."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

from instruments.bench_config import BenchFile, shipped_benches
from instruments.checks.check import check
from instruments.checks.findings import DeviceReport
from instruments.clock import Clock, VirtualClock, WallClock
from instruments.shared_clock import clock_outside, served_clock
from instruments.simulation import Simulation, serve_simulation
from instruments.transport.factory import Wire
from labctl.answers.benches import (
    BenchCheckResponse,
    BenchDescription,
    BenchUnit,
    DeviceCheck,
    FindingResponse,
    ShippedBench,
)
from labctl.answers.wire_logs import RecordedSession
from labctl.errors import BadInput
from labctl.services.benches.pace import asked_speed, reached_speed
from labctl.services.benches.wire_log import recording
from labctl.services.planning.loading import load_bench


def check_bench(source: str, wire_log: Path | None = None) -> BenchCheckResponse:
    """Talk to every instrument of a bench and say what answered; nothing moves.

    `wire_log` is the file that gets every byte between labctl and the bench.
    """
    bench = load_bench(source)
    clock = clock_of(bench)
    with recording(wire_log, bench, clock, RecordedSession(kind="bench check")) as recorded:
        if recorded is None:
            return checked(bench, source, clock)
        reports = check_on_wire(bench, clock, recorded.wire)
        recorded.result.said = said_of(reports)
        return response_of(bench, source, reports)


def check_on_wire(bench: BenchFile, clock: Clock, wire: Wire) -> list[DeviceReport]:
    """Return the reports on the instruments of a bench whose wire is recorded, or answers itself."""
    return check(bench, clock, wire=wire)


def said_of(reports: Sequence[DeviceReport]) -> list[str]:
    """Return every finding of a check as a line, to compare two checks."""
    return [f"{report.device}: {one.what}: {one.text} ({one.state})" for report in reports for one in report.findings]


def checked(bench: BenchFile, source: str, clock: Clock, simulation: Simulation | None = None) -> BenchCheckResponse:
    """Return what was found out about a bench whose drivers are resolved; `source` is what it is called."""
    return response_of(bench, source, check(bench, clock, simulation))


def response_of(bench: BenchFile, source: str, reports: Sequence[DeviceReport]) -> BenchCheckResponse:
    """Return the reports on the instruments of a bench as a response, dated now."""
    devices = [_device(report, bench) for report in reports]
    return BenchCheckResponse(
        bench=source, ok=all(device.ok for device in devices), checked_at=WallClock().utc(), devices=devices
    )


def description(
    bench: BenchFile,
    campaign: int | None,
    unconfirmed: str,
    check_: BenchCheckResponse | None,
    clock: Clock | None = None,
) -> BenchDescription:
    """Return a bench, what runs on it and on which clock, what its safe state did not confirm, and its last check."""
    return BenchDescription(
        name=bench.name,
        simulated=bench.is_simulated,
        latitude_deg=bench.latitude_deg,
        units=[BenchUnit(name=g.name, serial=g.serial, driver=g.driver) for g in bench.gyros],
        campaign=campaign,
        unconfirmed=unconfirmed,
        check=check_,
        speed=None if clock is None else asked_speed(clock),
        speed_reached=None if clock is None else reached_speed(clock),
    )


def _device(report: DeviceReport, bench: BenchFile) -> DeviceCheck:
    return DeviceCheck(
        device=report.device,
        ok=report.is_ok,
        text=report.text,
        kind=report.kind,
        state=report.state,
        address=report.address,
        findings=[FindingResponse(**asdict(finding)) for finding in report.findings],
        reported=report.reported,
        **bench.drivers[report.device].model_dump(),
    )


def clock_of(bench: BenchFile) -> Clock:
    """Return the clock of a check: that of simulators in another process runs at their speed."""
    return VirtualClock() if bench.is_simulated else clock_outside(bench)


def shipped() -> list[ShippedBench]:
    """Return the benches that come with labctl: name, and what stands on them."""
    benches = []
    for name, path in shipped_benches().items():
        bench = load_bench(str(path))
        units = ", ".join(f"{gyro.serial} ({gyro.driver})" for gyro in bench.gyros)
        benches.append(
            ShippedBench(
                name=name, text=", ".join([*(instrument.driver for instrument in bench.instruments.values()), units])
            )
        )
    return benches


def serve_simulator(
    source: str, out: Path | None, speed: float, ready: Callable[[dict[str, str]], None], log: Path | None = None
) -> None:
    """Put a bench's simulated instruments on real pseudo-terminals and TCP ports, until interrupted.

    `log` gets one JSON document per line: when which instrument heard what, and whether the table turned.
    """
    if not 0 < speed < float("inf"):
        raise BadInput(f"--speed {speed}: give a positive number; 1 is real time")
    bench = load_bench(source)
    with served_clock(speed) as clock:
        serve_simulation(bench, clock, out, ready, log)
