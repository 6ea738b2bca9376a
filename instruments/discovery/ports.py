"""The serial ports of this computer, with their USB adapters and names that stay."""

from __future__ import annotations

import os
from dataclasses import dataclass

from serial.tools import list_ports

from instruments.transport.adapters import adapter_of
from instruments.transport.port_failures import permission_command, stable_name, users_of


@dataclass(frozen=True)
class PortInfo:
    """A serial port, as this computer knows it; nothing was sent to it."""

    device: str  #: as the system numbers it: /dev/ttyUSB0
    path: str  #: the name that a bench file should have
    adapter: str = ""  #: serial number of its USB adapter
    product: str = ""
    trouble: str = ""  #: why it cannot be used, and what to do


def port_info(path: str, product: str = "") -> PortInfo:
    """Return what is known of one port."""
    trouble = ""
    if not os.access(path, os.R_OK | os.W_OK):
        trouble = f"this user has no access to the port: {permission_command(path)}"
    elif users := users_of(path):
        trouble = f"{', '.join(users)} has the port open: end that process"
    return PortInfo(path, stable_name(path) or path, adapter_of(path), product, trouble)


def serial_ports() -> list[PortInfo]:
    """Return the serial ports that there are, in the order of their numbers."""
    return [port_info(found.device, found.product or "") for found in sorted(list_ports.comports())]
