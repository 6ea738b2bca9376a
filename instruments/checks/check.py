"""The check of a whole bench: every port, then every instrument; nothing moves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from instruments.bench import Bench, open_bench
from instruments.bench_config import BenchFile, DeviceSettings, GyroSettings
from instruments.checks.devices import ask_chamber, ask_gyro, ask_reference, ask_table
from instruments.checks.findings import DeviceReport, Finding, Kind
from instruments.checks.ports import before_opening, is_real_port, of_open_port, shared
from instruments.clock import Clock
from instruments.configuration import not_as_stated
from instruments.errors import InstrumentError
from instruments.simulation import Simulation
from instruments.transport.adapters import adapter_of
from instruments.transport.factory import Wire


def check(
    bench: BenchFile, clock: Clock, simulation: Simulation | None = None, wire: Wire | None = None
) -> list[DeviceReport]:
    """Return the findings about every instrument of a bench; raises as `open_bench`.

    Where `wire` answers in place of the instruments, nothing is found out about the ports of this computer.
    An instrument whose port cannot be used is not asked: the finding about the port gives the reason.
    """
    opened = open_bench(bench, clock, simulation, wire)
    ports = {name: str(section.port) for name, section, _ in _sections(bench) if is_real_port(section.port)}
    if wire is not None and wire.answers:
        ports.clear()
    sharing = shared(ports)
    reports = []
    try:
        for name, section, kind in _sections(bench):
            report = DeviceReport(name, kind, _address(section))
            if (port := ports.get(name)) is not None:
                report.add(before_opening(port))
                report.add([sharing[name]] if name in sharing else [])
            if report.is_ok:
                _ask(opened, report, section.configuration if isinstance(section, GyroSettings) else {})
                if port is not None:
                    report.add(_about_port(port, report))
            reports.append(report)
    finally:
        _close(opened)
    return reports


def _sections(bench: BenchFile) -> Iterator[tuple[str, DeviceSettings, Kind]]:
    kinds: dict[str, Kind] = {"table": "table", "chamber": "chamber"}
    kinds |= dict.fromkeys((each.name for each in bench.references), "reference")
    kinds |= dict.fromkeys((gyro.name for gyro in bench.gyros), "gyro")
    for name, section in bench.sections.items():
        yield name, section, kinds.get(name, "other")


def _address(section: DeviceSettings) -> str:
    if section.port is not None:
        return section.port
    if section.host is None:
        return ""
    return section.host if "://" in section.host else f"{section.host}:{section.tcp_port}"


def _ask(opened: Bench, report: DeviceReport, stated: Mapping[str, str]) -> None:
    if report.kind == "table" and opened.table is not None:
        ask_table(opened.table, report)
    elif report.kind == "chamber" and opened.chamber is not None:
        ask_chamber(opened.chamber, report)
    elif report.kind == "reference":
        ask_reference(opened.references[report.device], report)
    elif report.kind == "gyro":
        ask_gyro(opened.gyros[report.device], report)
        if (said := not_as_stated(stated, report.reported)) and report.reported:
            report.add([Finding("configuration", f"not set as the bench file states: {'; '.join(said)}", "bad")])


def _about_port(port: str, report: DeviceReport) -> list[Finding]:
    if adapter := adapter_of(port):
        report.reported["adapter"] = adapter
    if report.state == "bad":
        return []
    return of_open_port(port, wants_quick=report.kind != "chamber")


def _close(opened: Bench) -> None:
    try:
        opened.close()
    except (InstrumentError, OSError):
        return  # the findings report it
