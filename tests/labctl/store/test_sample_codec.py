"""The block codec gives back exactly what it was given, and notices when its bytes are not the same any more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hn

from labctl.errors import StoreError
from labctl.recording.spread import white_std
from labctl.store.sample_codec import FINAL, LIVE, pack, unpack

whole = hn.arrays(np.int64, 17, elements=st.integers(-(2**63), 2**63 - 1))
small = hn.arrays(np.int64, 17, elements=st.integers(-300, 300))
floats = hn.arrays(np.float64, 17)


@given(whole, small, floats, st.sampled_from([LIVE, FINAL]))
def test_any_columns_come_back(a: np.ndarray, b: np.ndarray, c: np.ndarray, effort: int) -> None:
    columns = {"a": a, "b": b, "c": c, "words": np.array(["x", "-x"] * 8 + ["é"])}
    back = unpack(pack(columns, effort))
    assert list(back) == list(columns)
    for name in ("a", "b", "words"):
        assert np.array_equal(back[name], columns[name])
    assert np.array_equal(back["c"], c, equal_nan=True)


@pytest.mark.parametrize("effort", [LIVE, FINAL])
@pytest.mark.parametrize(
    "values",
    [
        np.zeros(0, dtype=np.int64),
        np.array([7]),
        np.full(100, -3),
        np.arange(100) * 8_000_000 + 10**15,
        np.array([-(2**63), 2**63 - 1]),
        (np.arange(1000) * 1_000_000_007) // 3,
    ],
)
def test_special_shapes_come_back(values: np.ndarray, effort: int) -> None:
    assert np.array_equal(unpack(pack({"v": values}, effort))["v"], values)


def test_even_times_and_constants_cost_nearly_nothing() -> None:
    n = 7500
    columns = {
        "t": np.arange(n) * 8_000_000,
        "valid": np.ones(n, dtype=np.int64),
        "status": np.zeros(n, dtype=np.int64),
    }
    assert len(pack(columns, FINAL).data) < 200


def test_a_damaged_block_is_noticed() -> None:
    block = pack({"v": np.arange(100) ** 2}, FINAL)
    flipped = bytes([*block.data[:-1], block.data[-1] ^ 1])
    with pytest.raises(StoreError, match="checksum is wrong"):
        unpack(replace(block, data=flipped))


def test_white_level_does_not_see_lines_or_drift() -> None:
    rng = np.random.default_rng(1)
    t = np.arange(7500) / 125
    white = rng.normal(0, 0.1, 7500)
    assert white_std(white) == pytest.approx(0.1, rel=0.05)
    assert white_std(white + 5 * np.sin(2 * np.pi * 31.7 * t) + 0.01 * t) == pytest.approx(0.1, rel=0.05)
