"""What a STIM300 says of itself: bytes by the tables of data sheet TS1524 rev. 31, and where they stand in a stream."""

from __future__ import annotations

from typing import Any

import pytest

from instruments.protocols.stim300.datagrams import (
    Configuration,
    bias_trim_frame,
    configuration_frame,
    parse_bias_trim,
    parse_configuration,
    parse_serial_number,
    serial_number_frame,
)
from instruments.protocols.stim300.frames import scan
from instruments.protocols.stim300.layouts import AUXILIARY, LAYOUTS, PLAIN, PPS, SPECIALS, Content, crc32_mpeg2

#: Made by hand from table 5-16: revision K, firmware 12, 2000/s with everything and CR LF, 921600 bit/s, even, 2 stop
#: bits, all axes, average rate delayed, pulse per second, 5 g. The CRC is that of the definition.
BY_HAND = bytes.fromhex("bd4b0c9f2b7a44007044007044030800003330000000")


def test_lengths_and_padding_are_those_of_the_data_sheet() -> None:
    """Tables 5-12 and 5-22; the auxiliary input takes the place of the pulse."""
    lengths = (18, 28, 28, 38, 25, 42, 42, 59)
    assert tuple(LAYOUTS[identifier].length for identifier in PLAIN) == lengths
    with_pps = (22, 32, 32, 42, 29, 46, 46, 63)
    assert tuple(LAYOUTS[identifier].length for identifier in PPS) == with_pps
    assert tuple(LAYOUTS[identifier].length for identifier in AUXILIARY) == with_pps
    for row in (PLAIN, PPS, AUXILIARY):
        assert tuple(LAYOUTS[identifier].pad for identifier in row) == (2, 0, 0, 2, 3, 2, 2, 1)
    specials = {0xB1: (20, 0), 0xB5: (20, 0), 0xBC: (26, 2), 0xD1: (40, 0), 0xBE: (21, 3)}
    assert {key: (SPECIALS[key].length, SPECIALS[key].pad) for key in specials} == specials


def test_a_configuration_by_hand() -> None:
    frame = BY_HAND + crc32_mpeg2(BY_HAND + bytes(2)).to_bytes(4, "big")
    assert parse_configuration(frame) == Configuration(
        "K", 12, 2000, Content(True, True, True, True), True, 921_600, 2, "even", "xyz", "average", True, True, 5,
        ("262", "262", "16"),
    )  # fmt: skip
    assert parse_serial_number(frame) is None


@pytest.mark.parametrize(
    ("byte_6", "byte_7", "filters_hz", "g_compensation"),
    [
        (0x01, 0x20, ("16", "33", "66"), "off"),
        (0x34, 0x41, ("131", "262", "262"), "scale by accelerometer"),
        (0x44, 0x4B, ("262", "262", "262"), "bias and scale by accelerometer, 0.01 Hz"),
        (0x54, 0x4D, ("code 5", "262", "262"), "code 13"),
    ],
)
def test_filters_and_compensation_by_hand(
    byte_6: int, byte_7: int, filters_hz: tuple[str, ...], g_compensation: str
) -> None:
    body = BY_HAND[:6] + bytes([byte_6, byte_7]) + BY_HAND[8:]
    found = parse_configuration(body + crc32_mpeg2(body + bytes(2)).to_bytes(4, "big"))
    assert found is not None
    assert (found.filters_hz, found.g_compensation, found.ranges_dps) == (filters_hz, g_compensation, ("400",) * 3)


def test_a_bias_trim_by_hand() -> None:
    """The offsets of figure 8-1 to the digits that it prints: 0.02343, -0.01222 and 0.00111 deg/s."""
    body = bytes.fromhex("d1 000180 ffff38 000012") + bytes(26)
    trim_dps = parse_bias_trim(body + crc32_mpeg2(body).to_bytes(4, "big"))
    assert trim_dps == pytest.approx((0.02343, -0.01222, 0.00111), abs=1.5e-5)
    assert trim_dps is not None
    assert bias_trim_frame(trim_dps, crlf=False)[:36] == body
    assert parse_bias_trim(BY_HAND) is None


@pytest.mark.parametrize("rate_hz", [125, 250, 500, 1000, 2000, None])
@pytest.mark.parametrize("unit", ["rate", "incremental", "average", "integrated"])
def test_what_is_written_is_read(rate_hz: int | None, unit: Any) -> None:
    for datagram, (temperature, pps) in {0x90: (False, False), 0x94: (True, False), 0xF4: (True, True)}.items():
        given = Configuration(
            "-",
            255,
            rate_hz,
            Content(temperature=temperature, pps=pps),
            False,
            None,
            1,
            "odd",
            "z",
            unit,
            False,
            pps,
            30,
        )
        assert parse_configuration(configuration_frame(given)) == given
        assert given.datagrams[0] == datagram


def test_a_serial_number() -> None:
    frame = serial_number_frame("N25582405002002", crlf=True)
    assert frame[:9].hex() == "b74e25582405002002"
    assert frame[-2:] == b"\r\n"
    assert parse_serial_number(frame[:-2]) == "N25582405002002"


def frames(n: int) -> list[bytes]:
    bodies = [bytes([0x94, number] + [0xBC] * 19) for number in range(n)]  # the identifier of a special one in the data
    return [body + crc32_mpeg2(body + bytes(3)).to_bytes(4, "big") for body in bodies]


@pytest.mark.parametrize("at", [0, 3, 6])
def test_other_datagrams_of_the_unit_are_no_damage_wherever_the_stream_is_cut(at: int) -> None:
    says = [serial_number_frame("N25582405002002", crlf=False), BY_HAND[:0]]
    says[1] = configuration_frame(
        Configuration(
            "K", 12, 125, Content(temperature=True), False, 460_800, 1, "none", "xyz", "rate", False, True, 10
        )
    )
    parts = frames(6)
    data = b"".join([*parts[:at], *says, *parts[at:]])
    for cut in range(len(data) + 1):
        first = scan(data[:cut], LAYOUTS[0x94])
        second = scan(first.rest + data[cut:], LAYOUTS[0x94])
        got = first.frames.tobytes() + second.frames.tobytes()
        # at the end of the data nothing tells yet that the last bytes are whole
        assert got == b"".join(parts), cut
        assert [*first.specials, *second.specials] == says, cut
        assert (first.damaged, second.damaged, second.rest) == (0, 0, b""), cut
