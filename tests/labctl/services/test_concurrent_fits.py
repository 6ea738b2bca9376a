"""Two fits of one unit at the same time: each keeps a version of its own, and its document knows the number."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from instruments.clock import VirtualClock
from labctl.answers.calibrations import FitRequest
from labctl.errors import VersionTaken
from labctl.services.calibrations import fitting
from labctl.services.calibrations.next_version import TRIES, keep_next_version
from labctl.services.commands.registry import FIT, IMPORT_RECORDING
from labctl.services.commands.requests import RecordingFolder, ToUnit
from labctl.store import NewCalibration, Store, open_store
from labctl.store.repositories import calibrations
from tests.helpers.commands import local_executor
from tests.helpers.one_row_sets import AT, one_row_sets
from tests.helpers.paths import EXAMPLES

OSU = "OSU-FOG-2024"


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        opened.recordings.add_import(one_row_sets(3), AT)
        yield opened


def calibration(version: int) -> NewCalibration:
    return NewCalibration(None, None, "m", f"document {version}".encode(), "h" * 64, {"error": {}})


def test_a_number_that_was_taken_meanwhile_is_not_taken_twice(store: Store) -> None:
    """The second fit begins and ends while the first builds its document."""
    built: list[int] = []

    def first(version: int) -> NewCalibration:
        built.append(version)
        if version == 1:
            keep_next_version(store, "G-1", AT, calibration)
        return calibration(version)

    assert keep_next_version(store, "G-1", AT, first).version == 2
    assert built == [1, 2]
    assert store.calibrations.document("G-1", 1)[0] == b"document 1"
    assert store.calibrations.document("G-1", 2)[0] == b"document 2"
    assert [row.subject for row in store.audit.rows() if row.action == "fit"] == ["G-1 version 1", "G-1 version 2"]


def test_a_fit_ends_when_other_fits_keep_taking_its_number(store: Store) -> None:
    def slow(version: int) -> NewCalibration:
        store.calibrations.add("G-1", AT, version, calibration(version))
        return calibration(version)

    with pytest.raises(VersionTaken, match="was made by another fit in the meantime; fit again"):
        keep_next_version(store, "G-1", AT, slow)
    assert len(store.calibrations.versions("G-1")) == TRIES


def test_a_version_that_is_expected_under_a_taken_number_is_not_made(store: Store) -> None:
    """Two tabs make the same version: the second is refused, before it fits and also while it fits."""
    keep_next_version(store, "G-1", AT, calibration, 1)
    for expected in (1, 3):
        with pytest.raises(VersionTaken):
            keep_next_version(store, "G-1", AT, calibration, expected)

    def slow(version: int) -> NewCalibration:
        store.calibrations.add("G-1", AT, version, calibration(version))
        return calibration(version)

    with pytest.raises(
        VersionTaken, match=r"^G-1 version 2 exists already: m, made by a fit at .* make version 3 beside"
    ):
        keep_next_version(store, "G-1", AT, slow, 2)
    assert store.calibrations.versions("G-1") == [1, 2]


def test_the_newest_events_of_all_units_are_versions_and_acts(store: Store) -> None:
    for version in (1, 2):
        store.calibrations.add("G-1", AT + timedelta(hours=version), version, calibration(version))
    store.calibrations.certify("G-1", 1, "certify", by="Ann", reason="fits", at=AT + timedelta(hours=3))
    events = [(each.serial, each.version, each.act, each.by) for each in store.calibration_events.newest(2)]
    assert events == [("G-1", 1, "certify", "Ann"), ("G-1", 2, "made", "")]


def test_a_number_that_another_process_takes_between_look_and_write(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On PostgreSQL another transaction may end after this one looked: the constraint says so, with a 500 so far."""
    store.calibrations.add("G-1", AT, 1, calibration(1))
    real, looks = calibrations._next_version, [1]
    monkeypatch.setattr(calibrations, "_next_version", lambda *given: looks.pop() if looks else real(*given))
    with pytest.raises(VersionTaken):
        store.calibrations.add("G-1", AT, 1, calibration(1))
    assert store.calibrations.versions("G-1") == [1]
    with pytest.raises(sa.exc.IntegrityError):  # of another constraint: there is no such unit
        store.calibrations.add("nobody", AT, 1, calibration(1))


@pytest.mark.slow
def test_two_fits_at_once_are_two_versions(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    commands = local_executor(store, VirtualClock())
    commands.execute(IMPORT_RECORDING, RecordingFolder(EXAMPLES / "osu-fog"))
    both, real, numbers = threading.Barrier(2), fitting.build_calibration, []

    def build(*given: Any, version: int, **others: Any) -> Any:
        numbers.append(version)
        if len(numbers) <= 2:
            both.wait(60)
        return real(*given, version=version, **others)

    monkeypatch.setattr(fitting, "build_calibration", build)

    def fit(_: int) -> Any:
        return commands.execute(FIT, ToUnit(OSU, FitRequest(effects=["bias", "scale_factor"])))

    with ThreadPoolExecutor(2) as pool:
        answers = list(pool.map(fit, range(2)))
    assert sorted(numbers) == [1, 1, 2]
    assert sorted(answer.version for answer in answers) == [1, 2]
    for answer in answers:
        document, own = store.calibrations.document(OSU, answer.version)
        assert json.loads(document)["version"] == answer.version
        assert own == answer.hash
