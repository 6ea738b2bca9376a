"""USB adapters of serial ports: which one a port is, and that it is the one the bench file names.

Linux numbers ttyUSB ports in the order in which adapters are found: after a new start two of them may have changed
places. The serial number of an adapter does not change.
"""

from __future__ import annotations

import os

from serial.tools import list_ports

from instruments.errors import WrongInstrument


def adapter_of(port: str | None) -> str:
    """Return the serial number of the USB adapter of a port; empty where it has none, or is simulated.

    Of an adapter with several ports the number of the port follows: `FT4XYZ:1.2`.
    """
    if not port or "://" in port:
        return ""
    real = os.path.realpath(port)
    for port_info in list_ports.comports():
        if os.path.realpath(port_info.device) == real:
            _, several, interface = (port_info.location or "").partition(":")
            return f"{port_info.serial_number}{several}{interface}" if port_info.serial_number else ""
    return ""


def is_adapter(wanted_serial: str, serial: str) -> bool:
    """Return whether an adapter is the wanted one, named with or without the number of its port."""
    return wanted_serial in (serial, serial.partition(":")[0])


def require_adapter(device: str, port: str | None, serial: str | None) -> dict[str, str]:
    """Return the adapter of a port as something that a device reports; empty where it has none.

    Raises WrongInstrument where the bench file names another adapter.
    """
    adapter = adapter_of(port)
    if serial is not None and not is_adapter(serial, adapter):
        raise WrongInstrument(
            device,
            f"port {port} is on USB adapter {adapter or 'without a serial number'}, but the bench file or the "
            f"campaign names {serial}; two adapters may be exchanged: give the path of the port in /dev/serial/by-id",
        )
    return {"adapter": adapter} if adapter else {}
