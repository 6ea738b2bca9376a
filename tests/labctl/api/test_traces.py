"""HTTP: readings for display, however many there are, and for download."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from labctl.recording import Recording, RecordingInfo, read_recording
from labctl.services.recordings import envelopes
from labctl.services.recordings.readings_examined import examined_stored
from tests.helpers.recordings import STARTED
from tests.helpers.service import add_recording, service_of

SETS, EACH = 40, 1500
TRACE = "/api/recordings/1/trace"


@pytest.fixture
def samples() -> Recording:
    """40 data sets of 15 s at 100 Hz, 10 s apart, every fifth at rest, one reading marked bad without a number."""
    n = SETS * EACH
    dataset = np.repeat(np.arange(1, SETS + 1), EACH)
    t_s = 0.01 * np.arange(n) + 10.0 * (dataset - 1)
    rate = np.where(dataset % 5 == 0, 0.0, 20.0)
    gyro = rate + np.random.default_rng(4).normal(0, 0.05, n)
    gyro[777] = 99.0
    valid = np.ones(n, dtype=np.int64)
    gyro[888], valid[888] = np.nan, 0
    columns = {
        "dataset": dataset, "t_s": t_s, "run": np.ones(n, dtype=np.int64), "mounting": np.ones(n, dtype=np.int64),
        "position": np.full(n, "z"), "table_rate_dps": rate, "temperature_c": np.full(n, 25.0), "valid": valid,
        "gyro_z": gyro,
    }  # fmt: skip
    info = RecordingInfo(serial="FAST", axes=("z",), kind="samples", started_at=STARTED)
    return Recording(info, columns)


@pytest.fixture
def fast(client: TestClient, samples: Recording) -> TestClient:
    add_recording(client, samples)
    return client


def ask(client: TestClient, **query: Any) -> dict[str, Any]:
    answer = client.get(TRACE, params={"channel": "gyro_z", **query})
    assert answer.status_code == 200, answer.text
    return dict(answer.json())


def test_a_whole_recording_is_drawn_from_envelopes(
    fast: TestClient, samples: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    trace = ask(fast, points=500)
    gyro, t_s = samples.columns["gyro_z"], samples.columns["t_s"]
    assert trace["raw"] is False
    assert len(trace["t_s"]) <= 500
    assert all(n > 0 for n in trace["n"])
    assert sum(trace["n"]) == len(gyro) - 1  # all but the one that is no number
    assert max(trace["max"]) == pytest.approx(99.0)
    assert min(trace["min"]) == pytest.approx(np.nanmin(gyro), rel=1e-6)
    mean = np.average(trace["mean"], weights=trace["n"])
    assert mean == pytest.approx(np.nanmean(gyro), rel=1e-6)
    assert trace["t_s"] == sorted(trace["t_s"])
    assert (trace["from_s"], trace["until_s"], trace["unit"]) == (t_s[0], t_s[-1], "deg/s")
    monkeypatch.setattr(envelopes, "_made", None)  # kept: the readings are not read again
    assert ask(fast, points=500) == trace


@pytest.mark.parametrize("in_memory", [False, True])
def test_the_first_trace_of_an_examined_recording_reads_no_readings(
    fast: TestClient, samples: Recording, cache: Path, monkeypatch: pytest.MonkeyPatch, in_memory: bool
) -> None:
    trace = ask(fast, points=500)
    (file,) = cache.rglob("*.npz")
    file.unlink()
    store = service_of(fast).store
    examined_stored(store, store.recordings.get(1), samples if in_memory else None)
    monkeypatch.setattr(envelopes, "_made", None)
    assert ask(fast, points=500) == trace


def test_a_window_of_few_data_sets_is_drawn_from_the_readings(fast: TestClient, samples: Recording) -> None:
    t_s, gyro = samples.columns["t_s"], samples.columns["gyro_z"]
    inside = (t_s >= 30.0) & (t_s <= 38.0)
    trace = ask(fast, from_s=30.0, until_s=38.0, points=20_000)
    assert trace["raw"] is True
    assert trace["n"] == [1] * int(inside.sum())
    assert trace["mean"] == gyro[inside].tolist() == trace["min"] == trace["max"]
    few = ask(fast, from_s=30.0, until_s=38.0, points=10)
    assert len(few["t_s"]) == 10
    between = ask(fast, from_s=16.0, until_s=24.0)
    assert between["t_s"] == []


@pytest.mark.parametrize(
    ("query", "says"),
    [
        (
            {"channel": "gyro_y"},
            "recording 1 has no channel 'gyro_y'; choose one of gyro_z, table_rate_dps, temperature_c",
        ),
        ({"from_s": "nan"}, "from_s = nan s: give a finite number"),
        ({"from_s": 5, "until_s": 5}, "give a start that is before the end"),
    ],
)
def test_what_is_no_trace_is_refused_by_name(fast: TestClient, query: dict[str, Any], says: str) -> None:
    answer = fast.get(TRACE, params={"channel": "gyro_z", **query})
    assert (answer.status_code, says in answer.json()["detail"]) == (400, True), answer.text
    assert fast.get(TRACE).status_code == 422


def test_means_with_times_are_drawn_as_they_are(
    client: TestClient,
    make_points: Callable[..., Recording],
) -> None:
    points = make_points(np.arange(5.0), np.full(5, 25.0), np.arange(5.0))
    add_recording(client, points)
    assert ask(client)["mean"] == [0.0, 1.0, 2.0, 3.0, 4.0]
    columns = {name: values for name, values in points.columns.items() if name != "t_s"}
    add_recording(client, Recording(points.info, columns))
    refused = client.get("/api/recordings/2/trace", params={"channel": "gyro_z"})
    assert (refused.status_code, "without times" in refused.json()["detail"]) == (400, True)


def test_a_damaged_envelope_is_made_again(fast: TestClient, cache: Path) -> None:
    trace = ask(fast)
    (file,) = cache.rglob("*.npz")
    for content in (b"", file.read_bytes()[:1000]):
        file.write_bytes(content)
        assert ask(fast) == trace


def test_the_allan_deviation_of_a_data_set_and_at_rest(fast: TestClient) -> None:
    one = fast.get("/api/recordings/1/allan", params={"dataset": 3}).json()
    assert one["datasets"] == [3, 3]
    axis = one["axes"]["z"]
    assert axis["deviation_dps"][0] == pytest.approx(0.05, rel=0.1)
    assert {len(axis[name]) for name in ("tau_s", "low_dps", "high_dps", "model_dps")} == {len(axis["deviation_dps"])}
    assert axis["N"]["value"] == pytest.approx(0.05 * 0.1 * 60, rel=0.15)  # 0.05 deg/s at 100 Hz
    still = fast.get("/api/recordings/1/allan").json()
    assert still["datasets"][0] % 5 == 0
    assert still["duration_s"] == pytest.approx(15.0)
    assert fast.get("/api/recordings/1/allan", params={"dataset": 99}).status_code == 404


def test_too_little_at_rest_says_what_it_takes(client: TestClient, samples: Recording) -> None:
    first = {name: values[:200] for name, values in samples.columns.items()}
    add_recording(client, Recording(samples.info, first))
    for query in ({}, {"dataset": 1}):
        answer = client.get("/api/recordings/1/allan", params=query)
        assert (answer.status_code, "300" in answer.json()["detail"]) == (422, True)


@pytest.mark.parametrize("file_format", ["csv", "parquet"])
def test_a_recording_can_be_taken_away_and_read_again(
    fast: TestClient, samples: Recording, tmp_path: Path, file_format: str
) -> None:
    answer = fast.get("/api/recordings/1/file", params={"format": file_format})
    assert answer.status_code == 200
    assert answer.headers["content-disposition"] == 'attachment; filename="recording-1.zip"'
    assert int(answer.headers["content-length"]) == len(answer.content)
    with zipfile.ZipFile(io.BytesIO(answer.content)) as archive:
        assert sorted(archive.namelist()) == ["recording-1/recording.toml", f"recording-1/samples.{file_format}"]
        archive.extractall(tmp_path)
    again = read_recording(tmp_path / "recording-1")
    assert np.array_equal(again.columns["gyro_z"], samples.columns["gyro_z"], equal_nan=True)
    assert fast.get("/api/recordings/1/file", params={"format": "xlsx"}).status_code == 422
    assert fast.get("/api/recordings/2/file").status_code == 404
