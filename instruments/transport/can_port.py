"""A CAN bus as a port: bytes are frames in the layout of `instruments.protocols.can.frames`, by python-can."""

from __future__ import annotations

import errno
from typing import TYPE_CHECKING, Any

from instruments.errors import one_line
from instruments.protocols.can.address import parsed
from instruments.protocols.can.frames import (
    BUS_OFF,
    ERROR,
    EXTENDED,
    EXTENDED_IDS,
    FRAME_BYTES,
    REQUEST,
    CanFrame,
    packed,
)

if TYPE_CHECKING:
    from can import BusABC, Message

#: A frame is sent within this time, s of real time, or the bus does not take it.
SEND_S = 1.0
#: One emptying takes at most this many frames: on a full bus it has an end.
MAX_FRAMES = 1 << 14


def open_can(url: str, *, timeout_s: float) -> CanPort:
    """Return an open bus; the time-out is s of real time. Raises OSError, ValueError with what python-can says."""
    address = parsed(url)
    options: dict[str, Any] = dict(address.options)  # each interface has its own
    try:
        import can
    except ImportError:
        raise OSError("python-can is not installed; run `pip install labctl[can]`") from None
    try:
        bus = can.Bus(channel=address.channel, interface=address.interface, ignore_config=True, **options)
    except OSError:
        raise
    except Exception as error:  # each interface raises what its library does
        raise OSError(f"{type(error).__name__}: {one_line(error)}") from error
    return CanPort(bus, timeout_s)


class CanPort:
    """An open bus. Frames of CAN FD are passed over. A failure of the interface is an OSError."""

    def __init__(self, bus: BusABC, timeout_s: float | None) -> None:
        self._bus: BusABC | None = bus
        self._timeout_s = timeout_s
        self._unread = bytearray()

    @property
    def is_open(self) -> bool:
        """Whether the bus is open."""
        return self._bus is not None

    @property
    def timeout(self) -> float | None:
        """Longest wait of `read`, s; None: without end."""
        return self._timeout_s

    @timeout.setter
    def timeout(self, timeout: float | None) -> None:
        self._timeout_s = timeout

    @property
    def in_waiting(self) -> int:
        """Number of bytes that can be read without waiting."""
        for _ in range(MAX_FRAMES):
            if not self._receive(0.0):
                break
        return len(self._unread)

    def read(self, size: int = 1, /) -> bytes:
        """Read `size` bytes, or those of the frames that arrive before the time-out."""
        while len(self._unread) < size and self._receive(self._timeout_s):
            pass
        data = bytes(self._unread[:size])
        del self._unread[:size]
        return data

    def write(self, data: bytes, /) -> int:
        """Send whole frames; raises ValueError for other bytes."""
        import can

        if len(data) % FRAME_BYTES:
            raise ValueError(f"{len(data)} bytes are no CAN frames; send multiples of {FRAME_BYTES} bytes")
        for at in range(0, len(data), FRAME_BYTES):
            id_, length = int.from_bytes(data[at : at + 4], "little"), data[at + 4]
            message = can.Message(
                arbitration_id=id_ & EXTENDED_IDS, is_extended_id=bool(id_ & EXTENDED),
                data=data[at + 8 : at + 8 + length],
            )  # fmt: skip
            try:
                self._opened.send(message, SEND_S)
            except can.CanError as error:
                raise OSError(f"frame 0x{id_ & EXTENDED_IDS:X} was not sent: {one_line(error)}") from error
        return len(data)

    def reset_input_buffer(self) -> None:
        """Drop unread frames."""
        _ = self.in_waiting
        self._unread.clear()

    def close(self) -> None:
        """Close the bus; safe to call twice."""
        bus, self._bus = self._bus, None
        if bus is not None:
            bus.shutdown()

    @property
    def _opened(self) -> BusABC:
        if self._bus is None:
            raise OSError("the CAN bus is closed")
        return self._bus

    def _receive(self, wait_s: float | None) -> bool:
        """Take one message in; return whether one came."""
        import can

        try:
            message = self._opened.recv(wait_s)
        except can.CanError as error:
            raise OSError(one_line(error)) from error
        if message is None:
            self._refuse_bus_off()
            return False
        if not message.is_fd:
            self._unread += packed(_frame_of(message))
        return True

    def _refuse_bus_off(self) -> None:
        """Put a bus-off that the interface states without an error frame among the frames."""
        import can

        try:
            is_off = self._opened.state is can.BusState.ERROR
        except (NotImplementedError, AttributeError, can.CanError):
            return
        if is_off and not self._unread:
            self._unread += packed(CanFrame(ERROR | BUS_OFF, b""))


def _frame_of(message: Message) -> CanFrame:
    if message.is_error_frame:
        return CanFrame(ERROR | (message.arbitration_id & EXTENDED_IDS), bytes(message.data))
    flags = (EXTENDED if message.is_extended_id else 0) | (REQUEST if message.is_remote_frame else 0)
    return CanFrame(flags | message.arbitration_id, b"" if message.is_remote_frame else bytes(message.data))


def remedy(url: str, error: Exception) -> str:
    """Return what to check of a bus that cannot be opened."""
    try:
        address = parsed(url)
    except ValueError:
        return "the address"
    number = getattr(error, "errno", None)
    if number == errno.EAFNOSUPPORT:
        return "that the kernel of this computer has CAN: `sudo modprobe can_raw`"
    if address.interface == "socketcan" and number in (errno.ENETDOWN, errno.ENODEV):
        rate = address.options.get("bitrate", 500000)
        name = address.channel
        return (
            f"that the interface is there and up: `ip link show {name}`, then `sudo ip link set {name} up type can "
            f"bitrate {rate} restart-ms 100`"
        )
    return "interface, channel and options of the address, the driver software of the adapter, and its cable"
