"""Parsing a STIM300 stream from bytes: every CRC checked, one frame in a thousand damaged."""

from __future__ import annotations

import numpy as np

from benchmarks.machine import describe, median_s
from instruments.protocols.stim300.frames import LAYOUTS, int16, int24, scan

N = 1_000_000


def run() -> dict[str, float | str]:
    """Return million datagrams per second for a long stream, and microseconds for one second's block."""
    layout = LAYOUTS[0x94]
    rng = np.random.default_rng(1)
    frames = rng.integers(0, 256, (N, layout.stride), dtype=np.uint8)
    frames[:, 0] = layout.id
    frames[:, layout.covered :] = layout.crc(frames).astype(">u4").view(np.uint8).reshape(N, 4)
    damaged = rng.choice(N, N // 1000, replace=False)
    frames[damaged, rng.integers(0, layout.stride, len(damaged))] ^= 0x5A
    stream, block = frames.tobytes(), frames[:125].tobytes()

    def parse(data: bytes) -> int:
        found = scan(data, layout)
        int24(found.frames, 1)
        int16(found.frames, layout.temperature or 0)
        return len(found.frames)

    assert parse(stream) == N - len(damaged)
    return {
        **describe("numpy"),
        "million_datagrams_per_s": N / median_s(lambda: parse(stream), runs=3) / 1e6,
        "block_of_125_us": 1e6 * median_s(lambda: parse(block), runs=200),
    }
