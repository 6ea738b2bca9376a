"""How an instrument is recognised on a port or host of which nothing is known. Nothing that is sent moves or sets it.

A stream is recognised by listening: not one byte is sent to a port on which something comes by itself. A silent port
is asked for an identity, by requests that only read.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from pymodbus import ModbusException
from pymodbus.client import ModbusTcpClient


@dataclass(frozen=True)
class Recognised:
    """An instrument that was recognised, and what its section of a bench file says besides the address."""

    text: str
    settings: Mapping[str, object] = field(default_factory=dict)
    #: Keys that a person has to confirm, as the wire does not tell them: key -> what it is.
    to_confirm: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Probe:
    """Recognises one kind of instrument on a serial port: by what comes, or by the answer to a request that reads."""

    baudrates: tuple[int, ...]
    recognise: Callable[[bytes, int], Recognised | None]  #: of what came, and the bit rate
    asks: bytes = b""  #: empty: it is only listened to
    wait_s: float = 0.6


@dataclass(frozen=True)
class HostProbe:
    """Recognises one kind of Modbus TCP instrument by registers that it reads."""

    recognise: Callable[[ModbusTcpClient], Recognised | None]


def words_of(client: ModbusTcpClient, number: int, count: int) -> list[int]:
    """Return registers of a host; empty where it has none such, or gives no answer."""
    try:
        reply = client.read_holding_registers(number, count=count, device_id=1)
    except ModbusException:
        return []
    return [] if reply.isError() else list(reply.registers)
