"""The check of a whole bench: every port, then every instrument; nothing moves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from instruments.bench import Bench, open_bench
from instruments.bench_config import BenchFile, DeviceSettings, GyroSettings
from instruments.checks.findings import DeviceReport, Finding, Kind, State
from instruments.checks.ports import before_opening, is_real_port, of_open_port, shared
from instruments.clock import Clock
from instruments.configuration import not_as_stated
from instruments.errors import InstrumentError
from instruments.interfaces.chamber import Chamber
from instruments.interfaces.gyro import Gyro, GyroIdentity, Readings
from instruments.interfaces.reference import Reference
from instruments.interfaces.self_checks import SelfChecking, StreamingGyro
from instruments.interfaces.supply import Supply
from instruments.interfaces.table import RateTable
from instruments.simulation import Simulation
from instruments.transport.adapters import adapter_of
from instruments.transport.factory import Wire

#: How long the readings of a unit are counted, s.
LISTEN_S = 5.0
#: Reads within that time: each is a point of the line that measures the unit's period.
READS = 20
#: A quiet unit that still gives more than this share of lost, damaged or bad readings is not fit for a campaign.
MAX_BAD_SHARE = 0.01


def ask_table(table: RateTable, report: DeviceReport) -> None:
    """Check the identity of the table, whether it is at rest, and its limits."""
    try:
        report.add([Finding("identity", table.identify())])
        if table.is_moving():
            report.add(
                [
                    Finding(
                        "motion", "the table is turning: stop it, and find out which program or person drives it", "bad"
                    )
                ]
            )
        else:
            report.add([Finding("motion", "it stands")])
    except InstrumentError as error:
        report.failed("identity", error)
        return
    limits = table.limits
    text = f"up to {limits.max_rate_dps:g} deg/s at {limits.max_acceleration_dps2:g} deg/s^2"
    text += f" in steps of {limits.step_deg:g} deg" if limits.step_deg else ""
    report.add([Finding("limits", text, value=limits.max_rate_dps, unit="deg/s")])
    if limits.step_deg:
        clock = "each campaign measures its step clock" if limits.clock_run_s else "its step clock is not measured"
        report.add([Finding("clock", clock)])
    _ask_shortcomings(table, report)


def ask_chamber(chamber: Chamber, report: DeviceReport) -> None:
    """Check the identity of the chamber, its air temperature, set point and alarms, and what prevents control."""
    try:
        report.add([Finding("identity", chamber.identify())])
        limits = chamber.limits
    except InstrumentError as error:
        report.failed("identity", error)
        return
    text = f"set points from {limits.min_c:g} to {limits.max_c:g} deg C in steps of {limits.resolution_c:g} deg C"
    report.add([Finding("limits", text)])
    try:
        now = chamber.read()
    except InstrumentError as error:
        report.failed("air temperature", error)
    else:
        report.add(
            [
                Finding("air temperature", f"air {now.temperature_c:.1f} deg C", value=now.temperature_c, unit="deg C"),
                Finding("set point", f"set point {now.setpoint_c:g} deg C", value=now.setpoint_c, unit="deg C"),
                *(_alarm(alarm) for alarm in now.alarms),
            ]
        )
        if not now.alarms:
            report.add([Finding("alarms", "no alarm")])
    _ask_shortcomings(chamber, report, otherwise="no profile runs")


def ask_reference(reference: Reference, report: DeviceReport) -> None:
    """Check the identity of a reference instrument, and its readings."""
    try:
        report.add([Finding("identity", reference.identify())])
        raw = reference.read().raw
    except InstrumentError as error:
        report.failed("identity" if not report.findings else "readings", error)
        return
    for channel in reference.channels:
        value = channel.offset + channel.scale * raw[channel.name]
        report.add([Finding(channel.name, f"{channel.name} {value:g} {channel.unit}", value=value, unit=channel.unit)])


def ask_supply(supply: Supply, report: DeviceReport) -> None:
    """Check the identity of the supply, its limits, and its output; nothing is switched."""
    try:
        report.add([Finding("identity", supply.identify())])
        raw, is_on = supply.read().raw, supply.is_on()
    except InstrumentError as error:
        report.failed("identity" if not report.findings else "readings", error)
        return
    limits = supply.limits
    report.add([Finding("limits", f"{limits.min_v:g} to {limits.max_v:g} V, at most {limits.current_limit_a:g} A")])
    for channel in supply.channels:
        value_v = channel.offset + channel.scale * raw[channel.name]
        report.add([Finding(channel.name, f"{channel.name} {value_v:g} {channel.unit}", value=value_v, unit="V")])
    if is_on:
        report.add([Finding("output", "the output is on")])
    else:
        text = "the output is off, so that the units do not answer; a campaign switches it on, or do so at its panel"
        report.add([Finding("output", text, "doubtful")])


def ask_gyro(gyro: Gyro, report: DeviceReport) -> None:
    """Check the identity of the unit, how its readings arrive, and its output at rest."""
    try:
        identity = gyro.identify()
        report.reported |= dict(identity.reported)
        report.add([Finding("identity", _identity(identity))])
        gyro.start()
        gyro.read_latest()
        readings = _listen(gyro)
    except InstrumentError as error:
        report.failed("identity" if not report.findings else "readings", error)
        return
    finally:
        gyro.stop()
    _judge_readings(gyro, readings, report)
    if isinstance(gyro, StreamingGyro):
        _judge_stream(gyro, report)
    report.add(_at_rest(gyro, readings))


def _listen(gyro: Gyro) -> Readings:
    """Return the readings of LISTEN_S; raises as `read`."""
    parts = [gyro.read(LISTEN_S / READS) for _ in range(READS)]
    return Readings(
        np.concatenate([part.t_s for part in parts]),
        {name: np.concatenate([part.raw[name] for part in parts]) for name in parts[0].raw},
        np.concatenate([part.valid for part in parts]),
        sum(part.lost for part in parts),
        sum(part.damaged for part in parts),
    )


def _alarm(alarm: str) -> Finding:
    text = f"the chamber reports: {alarm}; remove the cause at the chamber, then clear it at the controller's panel"
    return Finding("alarms", text, "bad")


def _ask_shortcomings(device: object, report: DeviceReport, otherwise: str = "") -> None:
    if not isinstance(device, SelfChecking):
        return
    try:
        shortcomings = device.shortcomings()
    except InstrumentError as error:
        report.failed("control", error)
        return
    report.add(Finding("control", text, "bad") for text in shortcomings)
    if otherwise and not shortcomings:
        report.add([Finding("control", otherwise)])


def _identity(identity: GyroIdentity) -> str:
    reported = ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in identity.reported.items())
    text = f"{identity.model}, serial {identity.serial}"
    return (
        f"{text}; the instrument reported: {reported}"
        if reported
        else f"{text}; the instrument reported no identification"
    )


def _judge_readings(gyro: Gyro, readings: Readings, report: DeviceReport) -> None:
    n = len(readings)
    if n < 2:
        text = f"{n} readings in {LISTEN_S:g} s: check sample_rate_hz {gyro.sample_rate_hz:g}, power and cable"
        report.add([Finding("readings", text, "bad", value=float(n))])
        return
    rate_hz = (n - 1) / float(readings.t_s[-1] - readings.t_s[0])
    invalid = int((~readings.valid).sum())
    text = f"{rate_hz:.6g} readings/s, {readings.lost} lost, {readings.damaged} damaged, {invalid} marked bad"
    wrong = readings.lost + readings.damaged + invalid
    if wrong > MAX_BAD_SHARE * n:
        text += f" of {n}: check cable, shield and bit rate, and that the unit is warm and within its range"
    state: State = "bad" if wrong > MAX_BAD_SHARE * n else "good"
    report.add([Finding("readings", text, state, value=rate_hz, unit="1/s")])


def _judge_stream(gyro: StreamingGyro, report: DeviceReport) -> None:
    period = gyro.period
    if period.measured_s is not None:
        off_ppm, u_ppm = 1e6 * (period.nominal_s / period.measured_s - 1.0), 1e6 * period.u_share
        text = (
            f"its clock differs by {off_ppm:+.0f} ppm from the clock of this computer (u = {u_ppm:.2g} ppm, "
            f"measured over {LISTEN_S:g} s)"
        )
        report.add([Finding("clock", text, value=off_ppm, unit="ppm")])
    if (steps := gyro.counter_step) is not None:
        measured_step, meant = steps
        text = f"counter step {measured_step}"
        if measured_step != meant:
            text += (
                f", but by the bench file it is {meant}: correct sample_rate_hz, datagram or the step of the counter "
                "there, or configure the unit"
            )
        report.add([Finding("counter", text, "good" if measured_step == meant else "bad", value=float(measured_step))])


def _at_rest(gyro: Gyro, readings: Readings) -> list[Finding]:
    """Return mean and scatter of what the unit sends besides its status."""
    findings = []
    for channel in gyro.channels:
        if not channel.unit or len(readings) < 2:
            continue
        values = channel.value(readings.raw[channel.name])
        mean, scatter = float(np.mean(values)), float(np.std(values, ddof=1))
        text = f"{channel.name} {mean:+.4g} {channel.unit} (scatter {scatter:.2g})"
        findings.append(Finding(channel.name, text, value=mean, unit=channel.unit))
    return findings


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
    kinds: dict[str, Kind] = {"table": "table", "chamber": "chamber", "supply": "supply"}
    kinds |= dict.fromkeys((reference.name for reference in bench.references), "reference")
    kinds |= dict.fromkeys((gyro.name for gyro in bench.gyros), "gyro")
    for name, section in bench.sections.items():
        yield name, section, kinds.get(name, "other")


def _address(section: DeviceSettings) -> str:
    if section.port is not None:
        return section.port
    if section.host is None:
        return ""
    return section.host if "://" in section.host else f"{section.host}:{section.tcp_port}"


def _ask(opened: Bench, report: DeviceReport, stated_reply: Mapping[str, str]) -> None:
    if report.kind == "table" and opened.table is not None:
        ask_table(opened.table, report)
    elif report.kind == "chamber" and opened.chamber is not None:
        ask_chamber(opened.chamber, report)
    elif report.kind == "supply" and opened.supply is not None:
        ask_supply(opened.supply, report)
    elif report.kind == "reference":
        ask_reference(opened.references[report.device], report)
    elif report.kind == "gyro":
        ask_gyro(opened.gyros[report.device], report)
        if (differences := not_as_stated(stated_reply, report.reported)) and report.reported:
            report.add([Finding("configuration", f"not set as the bench file states: {'; '.join(differences)}", "bad")])


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
