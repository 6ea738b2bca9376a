"""Ends of frames in a Modbus TCP stream."""

from __future__ import annotations

import pytest

from instruments.protocols.modbus_codes import ends_at_a_frame_end

FRAME = bytes.fromhex("0001 0000 0005 01 03 02 FF23")


@pytest.mark.parametrize(
    ("data", "whole"),
    [(b"", True), (FRAME, True), (FRAME * 3, True), (FRAME[:-1], False), (FRAME + b"\x55", False), (FRAME[:4], False)],
)
def test_a_stream_ends_where_its_length_fields_say(data: bytes, whole: bool) -> None:
    assert ends_at_a_frame_end(data) is whole
