"""A plan is walked through once: the same question finds the walk in a file."""

from __future__ import annotations

import io
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.services.simulation import walks
from labctl.services.simulation.visibility import planned_schedule
from procedures.planning.plan import Plan, make_plan


def plan_of(recipe: str) -> Plan:
    return make_plan(load_recipe(recipe), limits_of(load_bench("single-axis-sim")))


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path


def test_a_walk_from_a_file_is_the_walk_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    plan, bench = plan_of("short"), load_bench("single-axis-sim")
    made = walks._walk(plan, bench)
    first = walks.walked(plan, bench)
    monkeypatch.setattr(walks, "hidden_recording", None)  # a second walk would call it
    again = walks.walked(plan, bench)
    for kept in (first, again):
        assert kept.info == made.info
        assert made.environment is not None
        assert kept.environment is not None
        for one, other in ((made.columns, kept.columns), (made.environment, kept.environment)):
            assert list(one) == list(other)
            assert all(np.array_equal(one[name], other[name]) for name in one)


def test_short_data_sets_have_enough_readings_to_show_their_noise() -> None:
    recipe = load_recipe("short")
    quick = recipe.model_copy(update={"acquire": recipe.acquire.model_copy(update={"duration_s": 5.0})})
    bench = load_bench("single-axis-sim")
    plan = make_plan(quick, limits_of(bench))
    counts = np.unique(walks.walked(plan, bench).columns["dataset"], return_counts=True)[1]
    assert counts.min() >= walks.MIN_READINGS - 1
    assert planned_schedule(plan, bench).data.white_var is not None


def test_another_plan_or_bench_is_another_walk() -> None:
    bench = load_bench("single-axis-sim")
    short = walks.walked(plan_of("short"), bench)
    assert len(walks.walked(plan_of("gyrostar"), load_bench("single-axis-sim"))) != len(short)
    other = bench.model_copy(update={"gyros": (bench.gyros[0].model_copy(update={"serial": "FOG-9999"}),)})
    assert walks.walked(plan_of("short"), other).info.serial == "FOG-9999"


def flipped(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes(byte ^ 0xFF for byte in content[middle : middle + 4]) + content[middle + 4 :]


def packed_again(content: bytes, change: Callable[[dict[str, np.ndarray]], object]) -> bytes:
    """Return a file that decompresses well and whose arrays are others."""
    with np.load(io.BytesIO(zlib.decompress(content))) as stored:
        arrays = dict(stored)
    change(arrays)
    packed = io.BytesIO()
    np.savez(packed, **arrays)
    return zlib.compress(packed.getvalue())


def one_column_shorter(arrays: dict[str, np.ndarray]) -> None:
    arrays["readings/gyro_z"] = arrays["readings/gyro_z"][:-1]


def only_the_head(arrays: dict[str, np.ndarray]) -> None:
    for name in [name for name in arrays if name != "info"]:
        del arrays[name]


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda _: b"",
    "the first half": lambda content: content[: len(content) // 2],
    "no checksum": lambda content: content[:-4],
    "four bytes flipped": flipped,
    "not compressed": zlib.decompress,
    "half an archive": lambda content: zlib.compress((whole := zlib.decompress(content))[: len(whole) // 2]),
    "an archive with flipped bytes": lambda content: zlib.compress(flipped(zlib.decompress(content))),
    "no columns": lambda content: packed_again(content, only_the_head),
    "no head": lambda content: packed_again(content, lambda arrays: arrays.pop("info")),
    "another head": lambda content: packed_again(content, lambda arrays: arrays.update(info=np.zeros(3, np.uint8))),
    "columns of unequal lengths": lambda content: packed_again(content, one_column_shorter),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_damaged_file_is_computed_again(
    damage: Callable[[bytes], bytes], cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan, bench = plan_of("gyrostar"), load_bench("single-axis-sim")
    first = walks.walked(plan, bench)
    (file,) = cache.rglob("*.npz.zlib")
    whole = file.read_bytes()
    file.write_bytes(damage(whole))
    again = walks.walked(plan, bench)
    assert file.read_bytes() == whole
    assert list(again.columns) == list(first.columns)
    assert all(np.array_equal(first.columns[name], again.columns[name]) for name in first.columns)
