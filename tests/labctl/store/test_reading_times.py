"""Times of the unit's own clock and of arrival: kept with each reading, exported, sealed, and no measured channel."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from sqlite3 import connect
from typing import Any

import numpy as np
import pytest

from instruments.clock import VirtualClock
from labctl.fitting.criticism.channel_functions import NO_CHANNELS
from labctl.recording import read_recording
from labctl.recording.columns import ARRIVAL_S, DEVICE_S, READING_TIMES
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.services.planning.loading import load_bench
from labctl.services.recordings.transfer import export_recording, import_folder
from labctl.services.simulation.recordings import SimulateRequest, make_recording
from labctl.store import Store, check, open_store, sample_codec
from labctl.store.repositories.sample_blocks import join_blocks

#: One data set of a STIM300, 8 s.
RECIPE = """
name = "brief"
temperatures_c = [25.0]
rates_dps = [0.0]
positions = ["z"]
[soak]
hold_s = 10.0
max_drift_c = 5.0
drift_window_s = 10.0
[acquire]
duration_s = 8.0
settle_s = 1.0
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("times")
    (folder / "brief.toml").write_text(RECIPE, encoding="utf-8")
    with open_store(str(folder / "lab.sqlite"), write=True) as store:
        bench = load_bench("triaxial-sim")
        run(store, prepare(store, str(folder / "brief.toml"), bench, VirtualClock(), clip=False, fit=False))
    return folder / "lab.sqlite"


def blocks(path: Path) -> list[dict[str, Any]]:
    query = "SELECT n, codec, crc32, data FROM sample_blocks WHERE recording_id = 1 ORDER BY number, seq"
    with closing(connect(path)) as raw:
        return [sample_codec.unpack(sample_codec.Block(*row)) for row in raw.execute(query)]


def test_reading_times_are_stored_compactly(path: Path) -> None:
    found = blocks(path)
    stored = join_blocks(found)
    assert stored["device_ns"].dtype == np.int64
    assert np.diff(stored["device_ns"]) == pytest.approx(np.full(len(stored["t_ns"]) - 1, 8_000_000))
    assert (stored["arrival_100us"] * 100_000 >= stored["t_ns"] - 8_000_000).all()
    before = {name: values for name, values in stored.items() if name not in {"device_ns", "arrival_100us"}}
    sizes = [len(sample_codec.pack(each, sample_codec.FINAL).data) / len(stored["t_ns"]) for each in (stored, before)]
    assert sizes[0] - sizes[1] < 0.5  # bytes per reading


def test_they_are_exported_and_come_back(path: Path, tmp_path: Path) -> None:
    with open_store(str(path), write=False) as store:
        export_recording(store, 1, tmp_path / "out", "parquet")
        plain, full = store.recordings.samples(1), store.recordings.samples(1, times=True)
    assert not READING_TIMES & plain.columns.keys()
    assert [*full.columns][:4] == ["dataset", "t_s", DEVICE_S, ARRIVAL_S]
    taken = read_recording(tmp_path / "out")
    for name in READING_TIMES:
        assert np.array_equal(np.asarray(taken.columns[name]), np.asarray(full.columns[name]))
    with open_store(str(tmp_path / "other.sqlite"), write=True) as other:
        number = import_folder(other, tmp_path / "out", VirtualClock().utc()).recording
        again = other.recordings.samples(number, times=True)
        assert not READING_TIMES & other.recordings.samples(number).columns.keys()
        assert not READING_TIMES & {row.channel for row in other.recordings.means(number)}
    assert np.array_equal(np.asarray(again.columns[DEVICE_S]), np.asarray(full.columns[DEVICE_S]))


def test_no_cause_is_looked_for_in_them() -> None:
    assert READING_TIMES <= NO_CHANNELS


def test_the_seal_covers_them(path: Path, tmp_path: Path) -> None:
    copy = tmp_path / "lab.sqlite"
    for file in path.parent.glob("lab.sqlite*"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    columns = join_blocks(blocks(path))
    columns["device_ns"] = columns["device_ns"] + 1
    block = sample_codec.pack(columns, sample_codec.FINAL)
    with closing(connect(copy)) as raw, raw:
        raw.execute("UPDATE sample_blocks SET crc32 = ?, data = ? WHERE recording_id = 1", (block.crc32, block.data))
    assert any("readings" in str(each) for each in check(str(copy)).findings)


def test_a_recording_of_which_a_part_has_them_is_read_without(path: Path, tmp_path: Path) -> None:
    def without(store: Store) -> Any:
        parts = [dict(columns) for _, columns in store.recordings.iter_datasets(1, times=True)]
        return [parts[0], {name: each for name, each in parts[0].items() if name not in READING_TIMES}]

    with open_store(str(path), write=False) as store:
        found = without(store)
        store.recordings.iter_datasets = lambda *_, **__: enumerate(found)  # type: ignore[method-assign,assignment]
        samples = store.recordings.samples(1, times=True)
    assert not READING_TIMES & samples.columns.keys()
    assert len(samples) == 2 * len(found[0]["t_s"])


def test_a_simulated_recording_has_both_times() -> None:
    """Without a wire a reading arrives when it is made; the unit counts its readings from switch-on to switch-off."""
    made = make_recording(SimulateRequest(recipe="short", sample_rate_hz=5.0)).recording
    columns = {name: np.asarray(made.columns[name]) for name in ("dataset", "t_s", DEVICE_S, ARRIVAL_S, "power_s")}
    assert (columns[ARRIVAL_S] == columns["t_s"]).all()
    late_s = columns[DEVICE_S] - columns["power_s"]
    assert (late_s > -1e-6).all()  # the next whole count after the first reading of a data set
    assert (late_s < 0.2).all()
    counts = columns[DEVICE_S] / 0.2
    assert counts == pytest.approx(np.rint(counts))
    for number in np.unique(columns["dataset"]):
        of_one = columns["dataset"] == number
        assert np.diff(columns[DEVICE_S][of_one]) == pytest.approx(0.2)
