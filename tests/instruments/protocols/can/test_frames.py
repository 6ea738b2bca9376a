"""Frames as bytes, compared with python-can's own `struct can_frame`; addresses; frames that are cut or disturbed."""

from __future__ import annotations

import sys

import can
import numpy as np
import pytest
from can.interfaces.socketcan.socketcan import build_can_frame

from instruments.protocols.can.address import parsed
from instruments.protocols.can.frames import ERROR, EXTENDED, CanFrame, FrameScanner, frame_of_text, packed


def frames(n: int, seed: int = 1) -> list[CanFrame]:
    random = np.random.default_rng(seed)
    found = []
    for _ in range(n):
        extended = bool(random.integers(2))
        id_ = int(random.integers(1 << 29)) | EXTENDED if extended else int(random.integers(1 << 11))
        found.append(CanFrame(id_, random.bytes(int(random.integers(9)))))
    return found


@pytest.mark.skipif(sys.byteorder != "little", reason="the layout of the kernel has the byte order of the computer")
def test_the_layout_is_that_of_linux() -> None:
    """Byte 7, len8_dlc, counts for a DLC above 8 only; python-can repeats the length there."""
    for frame in frames(50):
        message = can.Message(
            arbitration_id=frame.id & 0x1FFFFFFF, is_extended_id=bool(frame.id & EXTENDED), data=frame.data
        )
        theirs = build_can_frame(message)
        assert packed(frame) == theirs[:7] + b"\0" + theirs[8:]


def test_frames_come_in_any_pieces() -> None:
    sent = frames(40)
    data = b"".join(map(packed, sent))
    scanner, found, damaged = FrameScanner(), [], 0
    for at in range(0, len(data), 7):
        part, bad = scanner.feed(data[at : at + 7])
        found, damaged = found + part, damaged + bad
    assert (found, damaged) == (sent, 0)


def test_bytes_that_are_no_frame_cost_no_other_frame() -> None:
    """The three zeros of each frame, the unused bytes and the length tell where a frame begins."""
    sent = frames(30)
    data = list(map(packed, sent))
    data.insert(10, b"\xff\xa7\x31")
    found, damaged = FrameScanner().feed(b"".join(data))
    assert found == sent
    assert damaged == 1
    garbage = np.random.default_rng(2).integers(1, 256, 20_000).astype(np.uint8).tobytes()
    scanner = FrameScanner()
    assert scanner.feed(garbage) == ([], 1)
    assert set(scanner.feed(b"".join(map(packed, sent)))[0]) >= set(sent[1:])


def test_a_frame_of_text_is_that_of_cansend() -> None:
    assert frame_of_text("123#DEADBEEF") == CanFrame(0x123, b"\xde\xad\xbe\xef")
    assert frame_of_text("18F00101#") == CanFrame(0x18F00101 | EXTENDED, b"")
    for wrong in ("123", "12#00", "800#00", "123#0", "123#000000000000000000", "FFFFFFFF#00", "xyz#00"):
        with pytest.raises(ValueError, match=r"is not a CAN frame; write three .* such as 000#0100"):
            frame_of_text(wrong)
    with pytest.raises(ValueError, match="at most 8 data bytes, not 9"):
        packed(CanFrame(1, bytes(9)))


@pytest.mark.parametrize(
    ("url", "interface", "channel", "options"),
    [
        ("can://socketcan/can0", "socketcan", "can0", {}),
        ("can://slcan//dev/ttyACM0?bitrate=500000#imu2", "slcan", "/dev/ttyACM0", {"bitrate": 500000}),
        ("can://pcan/PCAN_USBBUS1?bitrate=1000000&listen=true&x=0.5&y=a", "pcan", "PCAN_USBBUS1",
         {"bitrate": 1000000, "listen": True, "x": 0.5, "y": "a"}),
    ],
)  # fmt: skip
def test_addresses(url: str, interface: str, channel: str, options: dict[str, object]) -> None:
    assert parsed(url) == (interface, channel, options)


@pytest.mark.parametrize("url", ["can://socketcan", "can:///can0", "/dev/ttyUSB0", "can://"])
def test_other_addresses_are_refused(url: str) -> None:
    with pytest.raises(ValueError, match="is no address of a CAN bus; write can://INTERFACE/CHANNEL"):
        parsed(url)


def test_error_frames_are_frames() -> None:
    error = CanFrame(ERROR | 0x88, bytes(8))
    assert FrameScanner().feed(packed(error)) == ([error], 0)
