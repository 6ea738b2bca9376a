"""Databases of the past: migrated or left alone, resumed to the end, judged and exported as they were."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import signal
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
from pyarrow import parquet

from labctl.recording.recording import Recording
from labctl.services.admin.api_keys import identify
from labctl.services.joint_reads import JointReads
from labctl.store import keys_by_digests, migrate, open_store
from tests.helpers.corpus import ENTRIES, SAME, SERIAL, Entry, migrated, wrongly_named
from tests.helpers.lab import Lab
from tests.helpers.shared_criticisms import criticised_once

#: Each step once, from the oldest database that has it ahead, and of each database its first and last step.
AHEAD = {entry.name: [step for step in sorted(migrate.KNOWN) if step > entry.name] for entry in ENTRIES}
STEPS = [
    (entry, step)
    for entry in ENTRIES
    for step in AHEAD[entry.name]
    if entry is ENTRIES[0] or step in (AHEAD[entry.name][0], AHEAD[entry.name][-1])
]
#: How both recordings were fitted (scripts/corpus-entry).
FITS = {
    "1": ("--model", "ojeda2000"),
    "2": ("--effects", "bias,bias_temperature:2,scale_factor,scale_factor_temperature:2"),
}
#: A coefficient of a fit with another estimate of the noise may differ by so much of its uncertainty: where the model
#: holds, and where it leaves hundreds of times the noise, so that the values hang on how the data sets are weighted.
FITTED_WITHIN, UNFITTED_WITHIN, MAX_SCALE = 0.15, 1.0, 10.0
of_each_entry = pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
#: What takes longer: the oldest and the newest database among the quick tests, those between among the slow ones.
from_end_to_end = pytest.mark.parametrize(
    "entry",
    [pytest.param(entry, marks=[pytest.mark.slow] if entry in ENTRIES[1:-1] else []) for entry in ENTRIES],
    ids=lambda entry: entry.name,
)


@pytest.fixture(scope="module")
def labs(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Entry], Lab]:
    """Return the database of an entry, migrated once for all tests of this module."""
    opened: dict[str, Lab] = {}

    def lab_of(entry: Entry) -> Lab:
        if entry.name not in opened:
            folder = tmp_path_factory.mktemp(entry.name)
            migrated(entry.unpack(folder))
            opened[entry.name] = Lab(folder)
        return opened[entry.name]

    return lab_of


@pytest.fixture(scope="module")
def once() -> Iterator[None]:
    """Work out what is the same in several entries once: their recordings are read and answered for each of them."""
    with criticised_once():
        yield


@contextmanager
def before_step_is_noted(step: str, act: Callable[[], None]) -> Iterator[None]:
    """Do something once the tables of a step are changed, and before the database says that they are."""

    def watch(_connection: Any, _cursor: Any, statement: str, *_: Any) -> None:
        if statement.startswith("UPDATE alembic_version") and f"'{step}'" in statement.partition("WHERE")[0]:
            act()

    sa.event.listen(sa.Engine, "before_cursor_execute", watch)
    try:
        yield
    finally:
        sa.event.remove(sa.Engine, "before_cursor_execute", watch)


def schema_of(path: Path) -> str:
    with closing(sqlite3.connect(path)) as raw:
        return str(raw.execute("SELECT version_num FROM alembic_version").fetchone()[0])


def tables_of(path: Path) -> list[tuple[str, ...]]:
    """Return every table and index of a database, in one form of white space."""
    with closing(sqlite3.connect(path)) as raw:
        found = raw.execute("SELECT type, name, sql FROM sqlite_master").fetchall()
    return sorted((kind, name, " ".join((sql or "").split())) for kind, name, sql in found)


def new(path: Path) -> Path:
    with open_store(str(path), write=True):
        return path


@of_each_entry
def test_it_is_migrated_to_the_tables_of_a_new_database(
    labs: Callable[[Entry], Lab], entry: Entry, tmp_path: Path
) -> None:
    assert tables_of(labs(entry).database) == tables_of(new(tmp_path / "new.sqlite"))


@of_each_entry
def test_it_is_migrated_whole_and_checked(labs: Callable[[Entry], Lab], entry: Entry) -> None:
    lab = labs(entry)
    assert schema_of(lab.database) == migrate.HEAD
    found = lab.json("check")
    assert (found["ok"], found["findings"]) == (True, [])
    if "check" in entry.answers:
        assert wrongly_named(entry, "check", entry.answers["check"], found) == []
    if "audit" in entry.answers:
        assert wrongly_named(entry, "audit", entry.answers["audit"], lab.json("audit", "verify")) == []
    listed = [{key: row[key] for key in entry.answers["campaigns"][0]} for row in lab.json("campaign", "list")]
    assert listed == entry.answers["campaigns"]


@pytest.mark.parametrize(("entry", "step"), STEPS, ids=lambda each: getattr(each, "name", each))
def test_a_migration_that_fails_in_a_step_leaves_the_old_database(entry: Entry, step: str, tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    entry.unpack(tmp_path)
    before = lab.content()

    def fail() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), before_step_is_noted(step, fail):
        migrated(lab.database)
    assert lab.content() == before
    assert schema_of(lab.database) == entry.name


def migrate_and_be_killed(path: Path, step: str) -> None:
    """Migrate in a process that is killed in a step."""
    child = os.fork()
    if child == 0:
        try:
            with before_step_is_noted(step, lambda: os.kill(os.getpid(), signal.SIGKILL)):
                migrated(path)
        finally:
            os._exit(1)
    assert os.WTERMSIG(os.waitpid(child, 0)[1]) == signal.SIGKILL


@from_end_to_end
def test_a_migration_that_is_killed_leaves_the_old_database_and_is_done_again(
    labs: Callable[[Entry], Lab], entry: Entry, tmp_path: Path
) -> None:
    lab = Lab(tmp_path)
    entry.unpack(tmp_path)
    before = lab.content()
    ahead = AHEAD[entry.name]
    migrate_and_be_killed(lab.database, ahead[len(ahead) // 2])
    assert (schema_of(lab.database), lab.content()) == (entry.name, before)
    migrated(lab.database)
    assert schema_of(lab.database) == migrate.HEAD
    assert lab.json("check")["ok"]


@pytest.mark.slow
@from_end_to_end
def test_the_unfinished_campaign_is_resumed_to_its_end(
    labs: Callable[[Entry], Lab], entry: Entry, tmp_path: Path
) -> None:
    for file in labs(entry).folder.glob("lab.sqlite*"):
        shutil.copy(file, tmp_path)
    lab = Lab(tmp_path)
    measured = points_of(lab, 3)  # those of campaign 1 and of the import come before it
    assert 0 < len(measured) < entry.answers["plans"]["recipe.toml"]["datasets"]
    ended = lab.json("campaign", "resume", "2", "--bench", str(entry.folder / "bench.toml"))
    assert ended["state"] == "done"
    points = points_of(lab, ended["recordings"][SERIAL])
    assert len(points) == entry.answers["plans"]["recipe.toml"]["datasets"]
    kept = points.gyro_dps("z")[: len(measured)]
    np.testing.assert_array_equal(kept, measured.gyro_dps("z"))  # what was measured before is not measured again
    assert lab.json("check")["ok"]


def points_of(lab: Lab, recording: int) -> Recording:
    """Return the means of a recording's complete data sets."""
    with open_store(str(lab.database), write=False) as store:
        return store.recordings.points(recording)


def judged(lab: Lab, number: str) -> dict[str, Any]:
    """Return what is said of a version of the calibration against the recording of the same number."""
    said = lab.run("criticise", SERIAL, "--version", number, "--recording", number, "--json", status=None)
    found = json.loads(said.stdout)
    suspects = found["suspects"]
    kept = {key: found[key] for key in ("verdict", "text", "named", "depends_on")}
    error = {key: found["error"][key] for key in ("rms_dps", "noise_floor_dps", "explained")}
    return {**kept, **error, "first_suspect": suspects[0]["effect"] if suspects else None}


@pytest.mark.slow
@pytest.mark.usefixtures("once")
@pytest.mark.parametrize("number", ["1", "2"])
@of_each_entry
def test_its_calibrations_are_judged_as_they_were(labs: Callable[[Entry], Lab], entry: Entry, number: str) -> None:
    now = judged(labs(entry), number)
    assert wrongly_named(entry, f"criticisms.{number}", entry.answers["criticisms"][number], now) == []


@pytest.mark.parametrize("number", ["1", "2"])
@of_each_entry
def test_its_calibrations_are_exported_as_they_were(
    labs: Callable[[Entry], Lab], entry: Entry, number: str, tmp_path: Path
) -> None:
    labs(entry).run("calibration", SERIAL, "--version", number, "--out", str(tmp_path / "now.json"))
    was = json.loads((entry.folder / f"calibration-{number}.json").read_text(encoding="utf-8"))
    now = json.loads((tmp_path / "now.json").read_text(encoding="utf-8"))
    assert wrongly_named(entry, f"calibration-{number}", was, now) == []


@of_each_entry
def test_its_recording_is_exported_as_it_was(labs: Callable[[Entry], Lab], entry: Entry, tmp_path: Path) -> None:
    labs(entry).run("export", "recording", "1", "--out", str(tmp_path / "now"))
    for name in ("samples", "environment"):
        was, now = (
            parquet.read_table(folder / f"{name}.parquet") for folder in (entry.folder / "recording", tmp_path / "now")
        )
        assert now.equals(was)


@pytest.mark.parametrize(("number", "model"), FITS.items())
@from_end_to_end
def test_its_recordings_are_fitted_as_they_were(
    labs: Callable[[Entry], Lab], entry: Entry, number: str, model: tuple[str, ...], tmp_path: Path
) -> None:
    for file in labs(entry).folder.glob("lab.sqlite*"):
        shutil.copy(file, tmp_path)
    made = Lab(tmp_path).json("fit", SERIAL, "--recording", number, *model)
    now = made["axes"]["z"]["coefficients"]
    within = FITTED_WITHIN if made["noise"]["z"]["covariance_scale"] < MAX_SCALE else UNFITTED_WITHIN
    for name, was in entry.answers["fits"][number]["axes"]["z"]["coefficients"].items():
        assert now[name]["value"] == pytest.approx(was["value"], rel=SAME, abs=within * was["u"]), name


@pytest.mark.parametrize(
    "entry", [entry for entry in ENTRIES if "verified" in entry.answers], ids=lambda each: each.name
)
def test_it_verifies_the_calibration_as_it_did(labs: Callable[[Entry], Lab], entry: Entry) -> None:
    said = labs(entry).run("verify", SERIAL, "--version", "1", "--recording", "2", "--json", status=None)
    assert wrongly_named(entry, "verified", entry.answers["verified"], json.loads(said.stdout)) == []


@pytest.mark.parametrize("entry", [entry for entry in ENTRIES if "key" in entry.answers], ids=lambda each: each.name)
def test_its_api_key_is_still_known(labs: Callable[[Entry], Lab], entry: Entry) -> None:
    with open_store(str(labs(entry).database), write=False) as store:
        lookup = store.keys.lookup()
        keys = JointReads(partial(keys_by_digests, lookup))
        caller = asyncio.run(identify(keys, f"Bearer {entry.answers['key']}"))
        lookup.close()
    assert (caller.name, caller.role.value) == ("ada", "approver")
