"""What the computer knows of a serial port: existence, permission, stable name, other users, latency."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from instruments.checks.findings import Finding
from instruments.transport import latency
from instruments.transport.adapters import adapter_of
from instruments.transport.port_failures import permission_command, stable_name, users_of

#: FTDI adapters hold bytes back for up to this long when it is set to the least, ms.
QUICK_MS = 1
#: Names that depend on the order in which adapters are found.
NUMBERED = ("ttyUSB", "ttyACM")


def is_real_port(port: str | None) -> bool:
    """Return whether an address is a port of this computer, not a URL."""
    return bool(port) and "://" not in (port or "")


def before_opening(port: str) -> list[Finding]:
    """Return what keeps a port from being opened, without opening it; empty where nothing is known to."""
    if not Path(port).exists():
        return [
            Finding(
                "port",
                f"port {port} does not exist: plug the adapter in, or give the present name of the port; `labctl "
                "bench ports` lists all ports",
                "bad",
            )
        ]
    if not os.access(port, os.R_OK | os.W_OK):
        return [Finding("port", f"port {port} may not be used by this user: {permission_command(port)}", "bad")]
    return []


def of_open_port(port: str, *, wants_quick: bool) -> list[Finding]:
    """Return what is known of a port that can be opened: name, adapter, other users and latency."""
    name = Path(port).resolve().name
    adapter = adapter_of(port)
    about = f"port {port}"
    if os.path.realpath(port) != port:
        about += f" ({name})"
    about += f" on USB adapter {adapter}" if adapter else ""
    findings = [Finding("port", about)]
    stable = stable_name(port)
    if Path(port).name.startswith(NUMBERED):
        advice = f"set port = '{stable}'" if stable else "use the path of the port in /dev/serial/by-id or by-path"
        findings.append(
            Finding(
                "port name",
                f"the number of {name} depends on the order in which adapters are plugged in: {advice}",
                "doubtful",
            )
        )
    if users := users_of(port):
        findings.append(
            Finding(
                "port users",
                f"{', '.join(users)} also has {port} open and takes bytes from it: end that process",
                "doubtful",
            )
        )
    latency_ms = latency.latency_timer_ms(name)
    if latency_ms is not None:
        slow = wants_quick and latency_ms > QUICK_MS
        text = f"the adapter delays received bytes by up to {latency_ms} ms"
        file = latency.SYS_TTY / name / "device" / "latency_timer"
        advice = f": run `echo {QUICK_MS} | sudo tee {file}`"
        findings.append(
            Finding("latency timer", text + advice if slow else text, "doubtful" if slow else "good", latency_ms, "ms")
        )
    return findings


def shared(ports: Mapping[str, str]) -> dict[str, Finding]:
    """Return a finding for each device whose port is that of an earlier device, also under another name."""
    findings: dict[str, Finding] = {}
    first: dict[str, str] = {}
    for device, port in ports.items():
        real = os.path.realpath(port)
        other = first.setdefault(real, device)
        if other != device:
            text = f"port {port} is also given for {other} ({ports[other]}): give each instrument a different port"
            findings[device] = Finding("port", text, "bad")
    return findings
