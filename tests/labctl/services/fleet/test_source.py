"""Jobs whose workers read published recordings: the same results to the last digit, and nothing else is accepted."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from sqlite3 import connect
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from fsspec.implementations.local import LocalFileSystem
from fsspec.implementations.memory import MemoryFileSystem

from instruments.clock import VirtualClock
from labctl.answers.fleet import FleetPublishRequest
from labctl.answers.storage_url import refused_because
from labctl.errors import BadInput, NotFound
from labctl.recording import Recording, read_recording
from labctl.recording.files import write_recording
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.services.fleet import jobs
from labctl.services.fleet.publishing import CONTENTS, publish
from labctl.services.fleet.task import FleetTask
from labctl.services.planning.loading import load_bench
from labctl.store import open_store
from labctl.store.paging import PageRequest
from labctl.store.repositories.published_readings import raw_of
from labctl.store.repositories.sample_blocks import DataSetHead, in_units
from tests.helpers.fleets import AT, HereEngine, add_units, run_job
from tests.helpers.lab import Lab
from tests.helpers.one_row_sets import one_row_sets

#: Readings of 9 data sets of a unit with three axes, which the bench keeps as the device sent them.
RECIPE = """
name = "brief"
temperatures_c = [25.0]
rates_dps = [0.0, 20.0, -20.0]
positions = ["x", "y", "z"]
[soak]
hold_s = 10.0
max_drift_c = 5.0
drift_window_s = 10.0
[acquire]
duration_s = 8.0
settle_s = 1.0
"""
#: Recordings by number: means of two units, readings of an imported one, and those of a campaign.
POINTS, OTHER, IMPORTED, MEASURED = 1, 2, 3, 4
DATA = {POINTS: "points", OTHER: "points", IMPORTED: "samples", MEASURED: "samples"}


def following(sets: int, per_set: int) -> Recording:
    """Return readings of unit A-1, whose output follows the table."""
    recording = one_row_sets(sets, "A-1", per_set=per_set)
    columns = dict(recording.columns)
    columns["gyro_z"] = 1.001 * columns["table_rate_dps"] + 0.02 * columns["gyro_z"]  # type: ignore[operator]
    return replace(recording, columns=columns)


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a database of four units, and their published recordings."""
    folder = tmp_path_factory.mktemp("laboratory")
    (folder / "brief.toml").write_text(RECIPE, encoding="utf-8")
    with open_store(str(folder / "lab.sqlite"), write=True) as store:
        add_units(store, 2)
        store.recordings.add_import(following(8, per_set=40), AT)
        bench = load_bench("triaxial-sim")
        run(store, prepare(store, str(folder / "brief.toml"), bench, VirtualClock(), clip=False, fit=False))
        made = publish(store, FleetPublishRequest(url=f"file://{folder}/published"))
    assert (made.units, made.written, made.unchanged, made.failed) == (len(DATA), len(DATA), 0, [])
    return folder


@pytest.fixture
def lab(laboratory: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return a copy of the folder, with nothing of it in the cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    yield Path(shutil.copytree(laboratory, tmp_path / "lab"))
    MemoryFileSystem.store.clear()


def without_readings(database: Path) -> None:
    """Take the readings out of a database; rows and digests stay."""
    with closing(connect(database)) as raw:
        raw.execute("UPDATE sample_blocks SET data = x'00'")
        raw.commit()


def results(database: Path, **asked: object) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the versions that a job of each kind made or judged, and what came of the units that failed."""
    kept, failed = {}, {}
    with open_store(str(database), write=True) as store:
        fits = {"kind": "fit", "effects": ["bias", "scale_factor"], "accept_warnings": True}
        for request in (fits, {"kind": "criticise", "search": "A-1"}):  # that of three axes takes seconds
            job = run_job(store, **request, **asked)
            for row in jobs.unit_answers(store, job.id, PageRequest()).rows:
                what = request["kind"], row.serial
                if row.state == "failed":
                    failed[what] = row.reason
                else:
                    kept[what] = (row.rms_dps, row.noise_floor_dps, row.verdict, row.named)
                    kept["answer", row.serial] = store.calibrations.get(row.serial, 1).answer
    return kept, failed


def reasons(lab: Path, database: Path | None = None, **asked: object) -> dict[str, str]:
    """Return the reasons of the units that could not be fitted from what is published."""
    asked = {"source": f"file://{lab}/published", "effects": ["bias"], "accept_warnings": True, "again": True, **asked}
    with open_store(str(database or lab / "lab.sqlite"), write=True) as store:
        job = run_job(store, kind="fit", **asked)
        assert (job.state, job.done + job.failed) == ("done", len(DATA))
        return {row.serial: row.reason for row in jobs.unit_answers(store, job.id, PageRequest(), "failed").rows}


@pytest.mark.slow
def test_results_are_those_of_the_database_to_the_last_digit_and_its_readings_are_not_read(
    lab: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copy(lab / "lab.sqlite", tmp_path / "emptied.sqlite")
    without_readings(tmp_path / "emptied.sqlite")
    whole = results(lab / "lab.sqlite")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "another cache"))
    published = results(tmp_path / "emptied.sqlite", source=f"file://{lab}/published")
    assert published == whole
    kept, failed = whole
    assert {serial for kind, serial in kept if kind == "fit"} >= {"U00000", "U00001", "A-1"}
    assert {kind for kind, _ in kept} == {"fit", "criticise", "answer"}
    assert not failed, failed
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "a third cache"))
    assert "checksum is wrong" in reasons(lab, tmp_path / "emptied.sqlite", source="")["A-1"]


def test_a_changed_missing_or_truncated_object_is_the_reason_of_its_unit_and_the_others_go_on(lab: Path) -> None:
    def file(recording: int) -> Path:
        return lab / "published" / f"recording-{recording}" / f"{DATA[recording]}.parquet"

    changed = pq.read_table(file(IMPORTED))
    values = np.array(changed["gyro_z"])
    values[17] = np.nextafter(values[17], np.inf)
    pq.write_table(changed.set_column(changed.column_names.index("gyro_z"), "gyro_z", [values]), file(IMPORTED))
    file(OTHER).write_bytes(file(OTHER).read_bytes()[:-100])
    file(POINTS).unlink()
    table = pq.read_table(file(MEASURED))
    rates = np.array(table["table_rate_dps"]) + 1e-9
    pq.write_table(
        table.set_column(table.column_names.index("table_rate_dps"), "table_rate_dps", [rates]), file(MEASURED)
    )
    found = reasons(lab)
    shown = {number: f"file://{file(number)}" for number in DATA}
    assert found["A-1"].startswith(f"{shown[IMPORTED]}: data set 1 is not that of recording 3 in the database")
    assert "the digest of its readings differs" in found["A-1"]
    assert found["U00001"].startswith(f"{shown[OTHER]}: not a complete Parquet file")
    assert found["U00001"].endswith("publish it again with --again")
    assert found["U00000"].startswith(f"{shown[POINTS]}: there is no such object; `labctl fleet publish file://")
    (measured,) = set(found) - {"A-1", "U00000", "U00001"}
    assert "column 'table_rate_dps' differs" in found[measured]
    assert all(text.count(";") == 1 for text in found.values())
    with open_store(str(lab / "lab.sqlite"), write=False) as store:
        again = publish(store, FleetPublishRequest(url=f"file://{lab}/published", again=True))
    assert again.written == len(DATA)
    shutil.copyfile(file(POINTS), file(OTHER))  # a whole object of another recording
    assert set(reasons(lab)) == {"U00001"}


def test_only_what_is_not_there_unchanged_is_published(lab: Path) -> None:
    request = FleetPublishRequest(url=f"file://{lab}/published/")
    with open_store(str(lab / "lab.sqlite"), write=True) as store:
        first = publish(store, request)
        assert (first.written, first.unchanged, first.size_bytes) == (0, len(DATA), 0)
        (lab / "published" / "recording-1" / "points.parquet").write_bytes(b"")
        (lab / "published" / "recording-2" / CONTENTS).write_text("[]")
        store.recordings.add_import(following(8, per_set=30), AT)
        second = publish(store, request)
        assert (second.written, second.unchanged) == (3, 1)  # of A-1 the newest recording alone is read by a job
        with pytest.raises(NotFound, match="no unit matches"):
            publish(store, request.model_copy(update={"type": "none"}))
    assert not list((lab / "published").rglob("*.part"))


def test_two_may_publish_at_once_and_what_cannot_be_written_leaves_no_part(
    lab: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    url, file_put = f"file://{lab}/both", LocalFileSystem.put_file
    request = FleetPublishRequest(url=url, search="U0000")
    with open_store(str(lab / "lab.sqlite"), write=False) as store:

        def beside(files: LocalFileSystem, source: str, target: str) -> None:
            file_put(files, source, target)
            monkeypatch.setattr(LocalFileSystem, "put_file", file_put)  # the other publishes while this one writes
            assert publish(store, request).written == 2

        monkeypatch.setattr(LocalFileSystem, "put_file", beside)
        first, second = publish(store, request), publish(store, request)
        assert (first.written, first.unchanged, second.written, second.unchanged) == (1, 1, 0, 2)

        def full(files: LocalFileSystem, source: str, target: str) -> None:
            Path(target).write_bytes(Path(source).read_bytes()[:10])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), target)

        monkeypatch.setattr(LocalFileSystem, "put_file", full)
        with pytest.raises(BadInput, match=r"No space left on device.*free space"):
            publish(store, request.model_copy(update={"again": True}))
    assert not list((lab / "both").rglob("*.part"))


@pytest.mark.slow
def test_what_is_published_is_a_recording_in_the_interchange_format(lab: Path) -> None:
    with open_store(str(lab / "lab.sqlite"), write=False) as store:
        for number in DATA:
            taken = read_recording(lab / "published" / f"recording-{number}")
            stored = store.recordings.samples(number, times=True)
            assert taken.info == stored.info
            for name, values in stored.columns.items():
                assert np.array_equal(np.asarray(taken.columns[name]), np.asarray(values)), name
            assert (taken.environment is None) == (stored.environment is None)
        write_recording(store.recordings.samples(IMPORTED), lab / "exported")
    shutil.copy(lab / "exported" / "samples.parquet", lab / "published" / "recording-3")  # by another program
    assert reasons(lab) == {}


def test_a_storage_without_recordings_ends_the_job(lab: Path) -> None:
    url = f"file://{lab}/absent"
    with open_store(str(lab / "lab.sqlite"), write=True) as store:
        with pytest.raises(NotFound, match=f"{url}: nothing is there; `labctl fleet publish {url}`"):
            run_job(store, source=url, search="U0000")
        (row,) = store.fleet.page(PageRequest()).rows
        assert (row.state, row.why.startswith(url)) == ("failed", True)
        with pytest.raises(BadInput, match="s3fs"):
            publish(store, FleetPublishRequest(url="s3://bucket/lab"))
        with pytest.raises(BadInput, match="choose a scheme that fsspec knows"):
            publish(store, FleetPublishRequest(url="sausage://bucket/lab"))


@pytest.mark.slow
def test_a_storage_that_is_lost_ends_the_job_and_leaves_its_other_units_to_do(lab: Path) -> None:
    begun: list[str] = []

    def lost_after_one(task: FleetTask) -> None:
        begun.append(task.serial)
        if len(begun) == 2:  # as where a file system is not mounted any more
            shutil.rmtree(lab / "published")
            (lab / "published").mkdir()

    with open_store(str(lab / "lab.sqlite"), write=True) as store:
        asked = {"source": f"file://{lab}/published", "effects": ["bias"], "accept_warnings": True}
        with pytest.raises(NotFound, match="nothing is there"):
            run_job(store, HereEngine(store, lost_after_one), **asked)
        (job,) = jobs.job_answers(store, PageRequest(), AT).rows
        assert (job.state, job.done, job.failed, job.waiting) == ("failed", 1, 0, len(DATA) - 1)
        assert run_job(store, **{**asked, "source": ""}).skipped == 1


def test_the_command_publishes_and_shows_no_password(lab: Path) -> None:
    commands = Lab(lab)
    done = commands.json("fleet", "publish", f"file://{lab}/elsewhere", "--search", "U0000")
    assert (done["written"], done["unchanged"], done["failed"]) == (2, 0, [])
    assert done["size_bytes"] == sum(file.stat().st_size for file in (lab / "elsewhere").rglob("*.*"))
    again = commands.run("fleet", "publish", f"file://{lab}/elsewhere", "--search", "U0000").stdout
    assert "0 recordings written (0 MB), 2 unchanged" in again
    for command in (["publish", "memory://lab"], ["criticise", "--source", "memory://lab"]):
        assert "in the memory of one process" in commands.run("fleet", *command, status=2).stderr
    secret = "s3://ann:hunter2@bucket/lab"
    for command in (["publish", secret], ["fit", "--effects", "bias", "--source", secret]):
        refused = commands.run("fleet", *command, status=2)
        assert "refused: it holds a user, a password" in refused.stderr
        assert "hunter2" not in refused.output + refused.stderr


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("https://host/lab?X-Amz-Signature=1", "a query"),
        ("sftp://ann@host/lab", "a user"),
        ("abfs://lab:key@account.dfs.core.windows.net/x", "a password"),
        ("simplecache::s3://bucket/lab", "not of the form"),
        ("/data/lab", "not of the form"),
        ("s3://", "not of the form"),
        ("file://data/lab", "begins with a slash"),
        ("memory://lab", "in the memory of one process"),
        ("data://lab", "in the memory of one process"),
        ("s3://" + "b" * 1000, "1005 characters"),
    ],
)
def test_urls_that_hold_secrets_or_name_no_place_are_refused(url: str, said: str) -> None:
    assert said in refused_because(url)
    for scheme in ("s3://bucket/lab", "file:///data/my lab", "abfs://lab@account.dfs.core.windows.net/x"):
        assert not refused_because(scheme)


def test_readings_in_their_units_are_turned_back_into_what_the_device_sent() -> None:
    draw = np.random.default_rng(5)
    channels: list[Any] = [
        {"name": "gyro_x", "unit": "deg/s", "scale": 400 / 2**23, "offset": 0.0},
        {"name": "temperature_c", "unit": "deg C", "scale": 1 / 256, "offset": 23.7},
        {"name": "reference_c", "unit": "deg C", "scale": 1e-3, "offset": -273.15, "stands_for": "temperature_c"},
    ]
    n = 1000
    raw = {
        "t_ns": np.sort(draw.integers(0, 10**15, n)), "valid": draw.integers(0, 2, n),
        "gyro_x": draw.integers(-(2**23), 2**23, n), "temperature_c": draw.integers(-(2**15), 2**15, n),
        "reference_c": draw.integers(200_000, 400_000, n), "device_ns": np.sort(draw.integers(0, 10**15, n)),
        "arrival_100us": np.sort(draw.integers(0, 10**10, n)), "chamber_mc": draw.integers(-40_000, 85_000, n),
    }  # fmt: skip
    head: DataSetHead = {
        "recording_id": 1, "number": 3, "position": "x", "run": 1, "mounting": 1, "table_rate_dps": 20.0,
        "table_angle_deg": 1.0, "gate_from_s": 0.0, "power_on_s": -60.0, "turn_deg": None, "turn_u_deg": None,
        "encoder": None, "verification": False,
    }  # fmt: skip
    columns = in_units([raw], head, channels, times=True)
    back = raw_of(columns, channels)
    assert back.keys() == raw.keys()
    for name, values in raw.items():
        assert np.array_equal(back[name], values), name
    with pytest.raises(KeyError, match="own_temperature_c"):
        raw_of({name: values for name, values in columns.items() if name != "own_temperature_c"}, channels)
