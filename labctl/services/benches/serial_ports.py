"""The serial ports of this computer, as a response."""

from __future__ import annotations

from dataclasses import asdict

from instruments.discovery import serial_ports
from labctl.answers.benches import PortResponse


def list_ports() -> list[PortResponse]:
    """Return every serial port, with its adapter and why it cannot be used; nothing is sent to any."""
    return [PortResponse(**asdict(serial_port)) for serial_port in serial_ports()]
