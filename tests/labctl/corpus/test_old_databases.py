"""Databases of the past: migrated or left alone, resumed to the end, judged and exported as they were."""

from __future__ import annotations

import json
import os
import shutil
import signal
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from labctl.services.admin.api_keys import identify
from labctl.store import migrate, open_store
from tests.helpers.corpus import ENTRIES, SERIAL, Entry, migrated, wrongly_named
from tests.helpers.lab import Lab

STEPS = [(entry, step) for entry in ENTRIES for step in sorted(migrate.KNOWN) if step > entry.name]
of_each_entry = pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)


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


@pytest.mark.parametrize("entry", [entry for entry in ENTRIES if entry.name < migrate.HEAD], ids=lambda each: each.name)
def test_a_migration_that_is_killed_leaves_the_old_database_and_is_done_again(
    labs: Callable[[Entry], Lab], entry: Entry, tmp_path: Path
) -> None:
    lab = Lab(tmp_path)
    entry.unpack(tmp_path)
    before = lab.content()
    ahead = [step for step in sorted(migrate.KNOWN) if step > entry.name]
    migrate_and_be_killed(lab.database, ahead[len(ahead) // 2])
    assert (schema_of(lab.database), lab.content()) == (entry.name, before)
    migrated(lab.database)
    assert schema_of(lab.database) == migrate.HEAD
    assert lab.json("check")["ok"]


@of_each_entry
def test_the_unfinished_campaign_is_resumed_to_its_end(
    labs: Callable[[Entry], Lab], entry: Entry, tmp_path: Path
) -> None:
    for file in labs(entry).folder.glob("lab.sqlite*"):
        shutil.copy(file, tmp_path)
    lab = Lab(tmp_path)
    assert {row["id"]: row["state"] for row in lab.json("campaign", "list")}[1] == "done"
    ended = lab.json("campaign", "resume", "2", "--bench", str(entry.folder / "bench.toml"))
    assert ended["state"] == "done"
    planned = entry.answers["plans"]["recipe.toml"]["datasets"]
    with open_store(str(lab.database), write=False) as store:
        points = store.recordings.points(ended["recordings"][SERIAL])
    assert len(points) == planned
    assert lab.json("check")["ok"]


def judged(lab: Lab, number: str) -> dict[str, Any]:
    """Return what is said of a version of the calibration against the recording of the same number."""
    said = lab.run("criticise", SERIAL, "--version", number, "--recording", number, "--json", status=None)
    found = json.loads(said.stdout)
    suspects = found["suspects"]
    kept = {key: found[key] for key in ("verdict", "text", "named", "depends_on")}
    error = {key: found["error"][key] for key in ("rms_dps", "noise_floor_dps", "explained")}
    return {**kept, **error, "first_suspect": suspects[0]["effect"] if suspects else None}


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


@pytest.mark.parametrize(
    "entry", [entry for entry in ENTRIES if "verified" in entry.answers], ids=lambda each: each.name
)
def test_it_verifies_the_calibration_as_it_did(labs: Callable[[Entry], Lab], entry: Entry) -> None:
    said = labs(entry).run("verify", SERIAL, "--version", "1", "--recording", "2", "--json", status=None)
    assert wrongly_named(entry, "verified", entry.answers["verified"], json.loads(said.stdout)) == []


@pytest.mark.parametrize("entry", [entry for entry in ENTRIES if "key" in entry.answers], ids=lambda each: each.name)
def test_its_api_key_is_still_known(labs: Callable[[Entry], Lab], entry: Entry) -> None:
    with open_store(str(labs(entry).database), write=False) as store:
        caller = identify(store, f"Bearer {entry.answers['key']}")
    assert (caller.name, caller.role.value) == ("ada", "approver")
