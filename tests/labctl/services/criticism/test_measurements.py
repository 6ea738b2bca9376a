"""A criticism reads its recording once: its row, its means and its readings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from labctl.answers.calibrations import FitRequest
from labctl.fitting.criticism import Criticism
from labctl.fitting.data.static_record import static_record
from labctl.recording import Recording, RecordingInfo
from labctl.services import forked
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.criticism.criticise import criticise_seen, criticise_unit
from labctl.services.criticism.decimated_readings import read_recording_of
from labctl.services.criticism.versions import version_of
from labctl.services.recordings.loading import chosen_rows, points_of
from labctl.store import open_store
from labctl.store.repositories.recordings import Recordings
from tests.helpers.simulated_recordings import single_axis

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
#: `_heads` is the query behind every way of reading a recording's row.
READS = ("_heads", "points", "samples", "iter_datasets", "dataset")


def counted(name: str, calls: Counter[str]) -> Callable[..., Any]:
    function = getattr(Recordings, name)

    def count(*args: Any, **kwargs: Any) -> Any:
        calls[name] += 1
        return function(*args, **kwargs)

    return count


@pytest.mark.slow
@pytest.mark.parametrize("number", [None, 1])
def test_a_criticism_reads_its_recording_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int | None
) -> None:
    """With experiments for what cannot be distinguished, which need the recording's campaign too."""
    monkeypatch.setattr(forked, "can_fork", lambda: False)  # what a fork reads is not counted here
    calls: Counter[str] = Counter()
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        store.recordings.add_import(single_axis(5, earth_rate_tilt=0.0012), AT)
        fit_unit(store, "FOG-0001", FitRequest(model="ojeda2000"), AT)
        for name in READS:
            monkeypatch.setattr(Recordings, name, counted(name, calls))
        answer = criticise_unit(store, "FOG-0001", 1, number)
    assert answer.verdict == "ambiguous"
    heads = 1 if number else 2  # the unit's recordings: the newest, and whether a newer one was passed over
    assert calls == {"_heads": heads, "points": 1, "iter_datasets": 1}


def at_rest(minutes: int) -> Recording:
    """Return a log at rest in which the temperature moves: its one data set is divided, and is its static record."""
    n = minutes * 60 * 20
    warm = 25.0 + 5.0 * np.linspace(0.0, 1.0, n) ** 2
    info = RecordingInfo(serial="MEMS-1", axes=("z",), kind="samples", started_at=AT, motion="rest")
    noise = np.random.default_rng(1).normal(0.0, 0.05, n)
    return Recording(info, {
        "dataset": np.ones(n, dtype=np.int64), "t_s": np.arange(n) / 20.0, "position": np.full(n, "z"),
        "table_rate_dps": np.zeros(n), "temperature_c": warm, "gyro_z": 0.3 + 0.01 * (warm - 25.0) + noise,
    })  # fmt: skip


@pytest.mark.slow
def test_a_criticism_reads_a_long_data_set_at_rest_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its pieces, its static record and its decimated readings are of one reading, and as they were of three."""
    monkeypatch.setattr(forked, "can_fork", lambda: False)
    calls: Counter[str] = Counter()
    recording = at_rest(20)
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        store.recordings.add_import(recording, AT)
        fit_unit(store, "MEMS-1", FitRequest(model="bias"), AT)
        row = store.recordings.get(1)
        read = read_recording_of(store, row)
        for name in READS:
            monkeypatch.setattr(Recordings, name, counted(name, calls))
        answer = criticise_unit(store, "MEMS-1", 1, 1)
        assert calls == {"_heads": 1, "points": 1, "iter_datasets": 1}
        alone, beside = points_of(store, row), points_of(store, row, lambda: read.pieces)
        assert len(alone) > 1
        assert all(np.array_equal(alone.columns[name], beside.columns[name]) for name in alone.columns)
        static = static_record(recording)
        assert read.static is not None
        assert static is not None
        assert read.static.duration_s == pytest.approx(static.duration_s, rel=1e-3)
        assert len(read.pieces[1]) == len(alone)
    assert answer.noise is not None


@pytest.mark.slow
def test_readings_that_a_fork_has_read_give_the_same_criticism(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answers = []
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        store.recordings.add_import(single_axis(5, earth_rate_tilt=0.0012), AT)
        fit_unit(store, "FOG-0001", FitRequest(model="ojeda2000"), AT)
        for forks in (False, True):
            calls: Counter[str] = Counter()
            monkeypatch.setattr(forked, "can_fork", lambda forks=forks: forks)
            monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / str(forks)))
            with monkeypatch.context() as counting:
                counting.setattr(Recordings, "iter_datasets", counted("iter_datasets", calls))
                answers.append(criticise_unit(store, "FOG-0001", 1, None))
            assert calls["iter_datasets"] == (2 if forks else 3)  # the inspection reads them too, twice
    assert answers[0] == answers[1]


@pytest.mark.slow
def test_a_criticism_for_a_fleet_has_the_same_verdict_and_plans_nothing(tmp_path: Path) -> None:
    seen: list[Criticism] = []
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        store.recordings.add_import(single_axis(3, saturation=-7e-4), AT)
        fit_unit(store, "FOG-0001", FitRequest(model="ojeda2000"), AT)
        row, measured = version_of(store, "FOG-0001", 1), chosen_rows(store, "FOG-0001", None)
        kept = criticise_seen(store, row, measured, seen.append)
        whole = criticise_unit(store, "FOG-0001", 1, None)
    assert (kept.verdict, kept.named, kept.error) == (whole.verdict, whole.named, whole.error)
    assert (kept.verdict, len(seen)) == ("ambiguous", 1)
    assert whole.experiments
    assert kept.experiments == []
