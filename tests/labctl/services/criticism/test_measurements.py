"""A criticism reads its recording once: its row, its means and its readings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from labctl.answers.calibrations import FitRequest
from labctl.services import forked
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.criticism.criticise import criticise_unit
from labctl.store import open_store
from labctl.store.repositories.recordings import Recordings
from tests.helpers.simulated_recordings import single_axis

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
#: `_heads` is the query behind every way of reading a recording's row.
READS = ("_heads", "points", "samples", "iter_datasets")


def counted(name: str, calls: Counter[str]) -> Callable[..., Any]:
    function = getattr(Recordings, name)

    def count(*args: Any, **kwargs: Any) -> Any:
        calls[name] += 1
        return function(*args, **kwargs)

    return count


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
