"""STIM300 datagrams: golden vectors, CRC, and a scanner that a slow and simple one agrees with on any bytes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from instruments.protocols.stim300.frames import LAYOUTS, Layout, crc32_mpeg2, int16, int24, scan

#: A real device's frame (0xAF: that of 0xA7 with four bytes of the AUX input), and two made by hand, CRC at the end.
GOLDEN = {
    0xAF: "af000124fffad600035b00ffe7a6ffdd36081c5200ff7e70feba0c3ffa1d0023a023c023a0002319230a231c00239523b6239500"
    "ffef0200e101fac64942c6",
    0x94: "94028000fae000000000001900f5805500000701fac86b4b61",
    0x90: "90006000ffc000000000000101f44b87156f",
}


def golden(kind: int) -> tuple[bytes, Layout]:
    data = bytes.fromhex(GOLDEN[kind])
    return data, replace(LAYOUTS[0xA7], id=0xAF, length=63) if kind == 0xAF else LAYOUTS[kind]


def test_crc_of_the_check_string() -> None:
    assert crc32_mpeg2(b"123456789") == 0x0376E6E7


@pytest.mark.parametrize("kind", GOLDEN)
def test_golden_frames_are_found_whole(kind: int) -> None:
    data, layout = golden(kind)
    assert len(data) == layout.length
    found = scan(data, layout)
    assert found.frames.tobytes() == data
    assert (found.rest, found.damaged) == (b"", 0)
    assert crc32_mpeg2(data[:-4] + bytes(layout.pad)) == int.from_bytes(data[-4:], "big")


def test_golden_values() -> None:
    data, layout = golden(0xAF)
    frames = scan(data, layout).frames
    assert int24(frames, 1)[0] / 2**14 == pytest.approx([0.01782, -0.08069, 0.05243], abs=5e-6)
    assert layout.temperature is not None
    assert (int16(frames, layout.temperature)[0] / 256).tolist() == [35.625, 35.75, 35.625]
    assert frames[0, layout.counter] == 225
    data, layout = golden(0x94)
    frames = scan(data, layout).frames
    assert (int24(frames, 1)[0] / 2**14).tolist() == [10.0, -20.5, 0.0]
    assert layout.temperature is not None
    assert (int16(frames, layout.temperature)[0] / 256).tolist() == [25.0, -10.5, 85.0]
    assert frames[0, layout.counter] == 7


def stream(layout: Layout, n: int, seed: int) -> bytearray:
    """Return `n` intact frames of random content, in which the id occurs often."""
    rng = np.random.default_rng(seed)
    out = bytearray()
    for _ in range(n):
        body = bytes([layout.id]) + rng.choice([layout.id, 0, 255, 17], layout.covered - 1).astype(np.uint8).tobytes()
        out += body + crc32_mpeg2(body + bytes(layout.pad)).to_bytes(4, "big") + (b"\r\n" if layout.crlf else b"")
    return out


def slow_scan(data: bytes, layout: Layout) -> tuple[list[bytes], bytes]:
    """Take one frame where one is whole, else go on by one byte."""
    frames, at = [], 0
    while len(data) - at >= layout.stride:
        body = data[at : at + layout.covered]
        sent = int.from_bytes(data[at + layout.covered : at + layout.length], "big")
        if data[at] == layout.id and crc32_mpeg2(body + bytes(layout.pad)) == sent:
            frames.append(bytes(data[at : at + layout.stride]))
            at += layout.stride
        else:
            at += 1
    return frames, bytes(data[at:])


@pytest.mark.slow
@settings(max_examples=150)
@given(
    kind=st.sampled_from([0x90, 0x94, 0xA7]),
    crlf=st.booleans(),
    seed=st.integers(0, 99),
    damage=st.lists(st.tuples(st.sampled_from(["flip", "cut", "insert"]), st.integers(0, 10**6)), max_size=4),
    cut=st.integers(0, 10**6),
)
def test_the_scanner_finds_what_a_slow_one_finds(
    kind: int, crlf: bool, seed: int, damage: list[tuple[str, int]], cut: int
) -> None:
    layout = replace(LAYOUTS[kind], crlf=crlf)
    data = stream(layout, 12, seed)
    for what, where in damage:
        at = where % len(data)
        if what == "flip":
            data[at] ^= 0x41
        elif what == "cut":
            del data[at : at + 3]
        else:
            data[at:at] = bytes([layout.id, 1, 2])
    whole, _ = slow_scan(bytes(data), layout)
    split = cut % len(data)
    first = scan(bytes(data[:split]), layout)
    second = scan(first.rest + bytes(data[split:]), layout)
    got = first.frames.tobytes() + second.frames.tobytes()
    assert got == b"".join(whole)
    if not damage:
        assert len(whole) == 12
        assert first.damaged + second.damaged == 0


def test_damage_is_counted_in_frames() -> None:
    layout = LAYOUTS[0x94]
    data = stream(layout, 5000, 3)
    for frame in (100, 2500, 2501, 4000):
        data[frame * layout.stride + 5] ^= 1
    found = scan(bytes(data), layout)
    assert (len(found.frames), found.damaged) == (4996, 4)
