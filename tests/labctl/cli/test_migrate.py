"""Databases of earlier versions: looking changes nothing; `labctl migrate` and `labctl serve` migrate, after a copy."""

from __future__ import annotations

import hashlib
import json
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from labctl.services.admin.maintenance import migrate_before_service
from labctl.store import check, migrate, open_store
from tests.helpers.corpus import ENTRIES
from tests.helpers.lab import Lab

OLD = next(entry for entry in ENTRIES if entry.name == "0016")


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    OLD.unpack(tmp_path)
    return Lab(tmp_path)


@pytest.mark.parametrize(
    "command",
    [
        ("units",),
        ("campaign", "list"),
        ("campaign", "status"),
        ("audit", "list"),
        ("audit", "verify"),
        ("key", "list"),
        ("certifications", "FOG-0001"),
        ("key", "create", "A", "--role", "viewer"),
        ("campaign", "resume"),
        ("bench", "status"),
    ],
    ids=" ".join,
)
def test_every_command_refuses_it_in_one_line_and_changes_nothing(lab: Lab, command: tuple[str, ...]) -> None:
    before = lab.content()
    said = lab.run(*command, status=2).stderr.strip()
    assert len(said.splitlines()) == 1
    assert f"is number 0016, this version of labctl needs number {migrate.HEAD}" in said
    assert f"run `labctl migrate --database {lab.database}`" in said
    assert lab.content() == before


def test_it_is_migrated_after_a_copy_that_is_the_database_as_it_was(lab: Lab) -> None:
    before = lab.content()
    said = lab.run("migrate").stdout
    assert f"migrated from schema 0016 to {migrate.HEAD}; the database as it was: " in said
    copy = lab.folder / "lab.sqlite.schema-0016"
    shutil.copytree(lab.folder, lab.folder / "old", ignore=shutil.ignore_patterns("lab.sqlite"))
    old = Lab(lab.folder / "old")
    shutil.copy(copy, old.database)
    assert old.content() == before
    found = check(str(lab.database))
    assert found.findings == ()
    assert found.not_sealed > 0  # the campaign whose process was killed
    assert (
        lab.run("migrate").stdout.strip().endswith(f"the schema is number {migrate.HEAD} already; nothing was changed")
    )


def test_records_of_before_are_said_to_be_sealed_by_the_migration(lab: Lab) -> None:
    lab.run("migrate", "--without-copy")
    assert not list(lab.folder.glob("*schema*"))

    with closing(sqlite3.connect(lab.database)) as raw, raw:
        reasons = {json.loads(row[0]).get("reason", "") for row in raw.execute("SELECT document FROM manifests")}
        raw.execute("UPDATE campaigns SET reason = 'another' WHERE id = 1")
    assert all(reason.startswith("sealed by migration on 20") for reason in reasons - {""})
    (finding,) = check(str(lab.database)).findings
    assert "campaign 1: state changed since it was sealed on" in finding.text
    assert "sealed by migration on" in finding.text


def test_the_answer_as_json(lab: Lab) -> None:
    answer = lab.json("migrate")
    assert (answer["from_schema"], answer["to_schema"]) == ("0016", migrate.HEAD)
    copy = Path(answer["copied_to"])
    assert hashlib.sha256(copy.read_bytes()).hexdigest() == answer["sha256"]


def test_what_is_no_database_is_refused(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    assert "there is no such file" in lab.run("migrate", status=2).stderr
    lab.database.write_bytes(b"")
    assert "it has no tables" in lab.run("migrate", status=2).stderr
    lab.database.write_bytes(b"something else" * 100)
    assert "not a labctl database, or damaged" in lab.run("migrate", status=2).stderr


def test_a_service_migrates_by_itself_after_a_copy(lab: Lab) -> None:
    answer = migrate_before_service(str(lab.database))
    assert answer is not None
    assert answer.copied_to == f"{lab.database}.schema-0016"
    with open_store(str(lab.database), write=True) as store:
        assert store.campaigns.all()
    assert migrate_before_service(str(lab.database)) is None
    assert migrate_before_service(str(lab.folder / "none.sqlite")) is None
