"""What was kept is there, or it is said: check, backup, the seal beside the database, and a full disk."""

from __future__ import annotations

import json
import shutil
import sqlite3
import zlib
from collections.abc import Iterator
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from instruments.clock import VirtualClock
from labctl.answers.calibrations import FitRequest
from labctl.answers.certification import CertifyRequest
from labctl.cli.app import app
from labctl.errors import DiskFull, StoreError
from labctl.recording import read_recording
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.services.commands.registry import CERTIFY, FIT, IMPORT_RECORDING
from labctl.services.commands.requests import RecordingFolder, ToUnit, ToVersion
from labctl.services.planning.loading import load_bench
from labctl.store import Store, check, copy_database, open_store
from labctl.store.connection import commit_seal as seals
from tests.helpers.certifying import REASON
from tests.helpers.commands import local_executor
from tests.helpers.paths import EXAMPLES

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database with a campaign's readings, an import, a calibration in force and their audit trail."""
    path = tmp_path_factory.mktemp("kept") / "lab.sqlite"
    clock = VirtualClock()
    with open_store(str(path), write=True) as store:
        run(store, prepare(store, "short", load_bench("single-axis-sim"), clock, clip=False))
        commands = local_executor(store, clock)
        commands.execute(IMPORT_RECORDING, RecordingFolder(EXAMPLES / "osu-fog"))
        commands.execute(FIT, ToUnit("OSU-FOG-2024", FitRequest(effects=["bias", "scale_factor"])))
        request = CertifyRequest(by="A", reason=REASON, override=True)
        commands.execute(CERTIFY, ToVersion("OSU-FOG-2024", 1, request))
    return path


@pytest.fixture
def location(kept: Path, tmp_path: Path) -> str:
    for file in kept.parent.glob("lab.sqlite*"):
        shutil.copy(file, tmp_path / file.name)
    return str(tmp_path / "lab.sqlite")


def spoil(location: str, *statements: str) -> None:
    with closing(sqlite3.connect(location)) as raw, raw:
        for statement in statements:
            raw.execute(statement)


def labctl(location: str, *arguments: str, status: int = 0) -> Any:
    result = CliRunner().invoke(app, [*arguments, "--database", location])
    assert result.exit_code == status, result.output + result.stderr + repr(result.exception)
    return result


def test_a_whole_database_has_no_findings(location: str) -> None:
    found = check(location)
    assert found.findings == ()
    assert found.blocks > 5
    assert (found.calibrations, found.audit_rows) == (1, 6)
    answer = json.loads(labctl(location, "check", "--json").stdout)
    assert (answer["ok"], answer["findings"]) == (True, [])


def one_block(location: str) -> tuple[int, bytes]:
    with closing(sqlite3.connect(location)) as raw:
        return raw.execute("SELECT id, data FROM sample_blocks ORDER BY id LIMIT 1").fetchone()


def flip(location: str, *, checksum: bool) -> None:
    """Change one byte in the middle of a block, and perhaps its checksum with it."""
    number, data = one_block(location)
    spoilt = bytearray(data)
    spoilt[len(spoilt) // 2] ^= 0x40
    with closing(sqlite3.connect(location)) as raw, raw:
        raw.execute("UPDATE sample_blocks SET data = ? WHERE id = ?", (bytes(spoilt), number))
        if checksum:
            raw.execute("UPDATE sample_blocks SET crc32 = ? WHERE id = ?", (zlib.crc32(spoilt), number))


def test_a_flipped_bit_in_a_block_is_found(location: str) -> None:
    flip(location, checksum=False)
    (finding,) = check(location).findings
    assert finding.part == "readings"
    assert "recording 1 data set 1 block 0" in finding.text
    assert "checksum is wrong" in finding.text
    said = labctl(location, "check", status=1)
    assert "readings: recording 1 data set 1 block 0" in said.stdout
    assert said.stdout.strip().endswith("1 finding")


def test_a_block_that_was_cut_short_under_a_new_checksum_is_found(location: str) -> None:
    number, data = one_block(location)
    short = data[: len(data) // 2]
    with closing(sqlite3.connect(location)) as raw, raw:
        raw.execute("UPDATE sample_blocks SET data = ?, crc32 = ? WHERE id = ?", (short, zlib.crc32(short), number))
    assert [finding.part for finding in check(location).findings] == ["readings"]


@pytest.mark.parametrize(
    ("statement", "part", "says"),
    [
        ("DELETE FROM sample_blocks WHERE id = 1", "readings", "but 0 are stored"),
        ("UPDATE sample_blocks SET seq = 1 WHERE id = 1", "readings", "blocks before block 1 are missing"),
        ("UPDATE sample_blocks SET number = 900 WHERE id = 1", "readings", "data set 900, which is missing"),
        (
            "UPDATE data_sets SET n = n + 1 WHERE recording_id = 1 AND number = 2",
            "readings",
            "as having 101 valid",
        ),
        (
            "DELETE FROM sample_blocks WHERE recording_id = 2",
            "readings",
            "recording 2 (points): its table of data sets is missing",
        ),
        ("UPDATE sample_blocks SET n = n - 1 WHERE id = 1", "readings", "recording 1 data set 1 block 0"),
        (
            "UPDATE calibrations SET document = replace(document, '\"fog\"', '\"mems\"')",
            "calibrations",
            "edited or damaged",
        ),
        ("UPDATE calibrations SET hash = substr(hash, 2) || '0'", "calibrations", "the stored calibration was changed"),
        ("UPDATE certifications SET version = 7", "file", "row 1 of certifications refers to a row of calibrations"),
        ("UPDATE audit SET actor = 'nobody' WHERE id = 3", "audit", "row 3: its content"),
        ("DELETE FROM audit WHERE id = 6", "audit", "row 6: 1 rows are missing at the end"),
        ("UPDATE alembic_version SET version_num = '0001'", "schema", "run `labctl migrate --database"),
        ("UPDATE alembic_version SET version_num = '9999'", "schema", "use a newer version"),
        ("DROP TABLE sample_blocks", "readings", "cannot be read"),
        ("UPDATE data_sets SET n = 'many' WHERE number = 2", "readings", "as having many valid"),
        ("UPDATE sample_blocks SET data = 'text' WHERE id = 1", "readings", "data set 1 block 0"),
        (
            "UPDATE data_set_means SET mean = mean + 1e-5 WHERE channel = 'gyro_z' AND number = 2",
            "readings",
            "data set 2: the stored mean of gyro_z is",
        ),
        (
            "UPDATE data_set_means SET n = 1 WHERE channel = 'gyro_z'",
            "readings",
            "the stored mean of gyro_z is of 1 readings",
        ),
        ("UPDATE audit SET detail = '{' WHERE id = 2", "audit", "row 2: its content"),
        ("UPDATE audit SET at = 'noon' WHERE id = 2", "audit", "row 2: its content"),
    ],
)
def test_what_is_not_as_it_was_written_is_found(location: str, statement: str, part: str, says: str) -> None:
    spoil(location, statement)
    findings = check(location).findings
    assert any(each.part == part and says in each.text for each in findings), findings


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.95])
def test_a_truncated_database_is_found(location: str, share: float) -> None:
    path = Path(location)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    said = labctl(location, "check", status=1)
    assert "file: " in said.stdout
    assert "Traceback" not in said.output


def test_something_else_is_no_database(location: str) -> None:
    Path(location).write_bytes(b"this is not a database at all" * 100)
    assert "file: " in labctl(location, "check", status=1).stdout


def test_a_missing_database_is_not_created(tmp_path: Path) -> None:
    missing = str(tmp_path / "nothing.sqlite")
    assert "there is no such file" in labctl(missing, "check", status=2).stderr
    assert "there is no such file" in labctl(missing, "backup", str(tmp_path / "copy"), status=2).stderr
    assert list(tmp_path.iterdir()) == []


def crashed(kept: Path, folder: Path) -> str:
    """What a process leaves that was killed: commits in the log that no checkpoint has brought home."""
    path = folder / "crashed.sqlite"
    shutil.copy(kept, path)
    shutil.copy(f"{kept}.seal", f"{path}.seal")
    with open_store(str(path), write=True) as store:
        local_executor(store, VirtualClock()).execute(IMPORT_RECORDING, RecordingFolder(EXAMPLES / "osu-fog"))
        left = folder / "left"
        left.mkdir()
        for file in folder.glob("crashed.sqlite*"):
            if file.suffix != ".lock":
                shutil.copy(file, left / file.name)
    return str(left / path.name)


def test_a_log_that_is_there_loses_nothing(kept: Path, tmp_path: Path) -> None:
    location = crashed(kept, tmp_path)
    with open_store(location, write=True) as store:
        assert len(store.recordings.of_unit("OSU-FOG-2024")) == 2
    assert check(location).findings == ()


def test_a_deleted_log_is_found_and_nobody_writes_on(kept: Path, tmp_path: Path) -> None:
    location = crashed(kept, tmp_path)
    Path(f"{location}-wal").unlink()
    Path(f"{location}-shm").unlink()
    finding, *more = check(location).findings
    assert {each.part for each in more} <= {"manifests"}  # the anchor file counts them too
    assert finding.part == "file"
    assert "1 commits that were made are not in this database" in finding.text
    assert "crashed.sqlite-wal" in finding.text
    with (
        pytest.raises(StoreError, match="commits that were made are not in this database"),
        open_store(location, write=True),
    ):
        pass
    seals.seal_path(location).unlink()
    with open_store(location, write=True) as store:
        assert len(store.recordings.of_unit("OSU-FOG-2024")) == 1


@pytest.mark.parametrize("how", ["removed", "emptied"])
def test_a_lost_archive_is_never_silently_begun_anew(location: str, how: str) -> None:
    path = Path(location)
    path.unlink() if how == "removed" else path.write_bytes(b"")
    for _ in range(2):
        with (
            pytest.raises(StoreError, match="commits that were made are not in this database"),
            open_store(location, write=True),
        ):
            pass


@pytest.fixture
def store(location: str) -> Iterator[Store]:
    with open_store(location, write=True) as opened:
        yield opened


def test_a_backup_while_others_write(store: Store, location: str, tmp_path: Path) -> None:
    """The writer is in the middle of an act; the copy is of what was kept before."""
    target = tmp_path / "copy.sqlite"
    with store.audit._database.writing() as connection:
        connection.exec_driver_sql("DELETE FROM environment")
        made = copy_database(location, target)
    assert (made.bytes, len(made.sha256)) == (target.stat().st_size, 64)
    assert check(str(target)).findings == ()
    assert sorted(path.name for path in tmp_path.glob("*copy*")) == ["copy.sqlite"]
    with open_store(str(target), write=True) as restored:
        assert restored.recordings.get(1).readings == store.recordings.get(1).readings
        assert restored.calibrations.document("OSU-FOG-2024", None) == store.calibrations.document("OSU-FOG-2024", None)


def test_a_backup_is_noted_and_never_written_over(location: str, tmp_path: Path) -> None:
    target = tmp_path / "copy.sqlite"
    answer = json.loads(labctl(location, "backup", str(target), "--json").stdout)
    assert (answer["noted"], answer["findings"]) == (True, [])
    content = target.read_bytes()
    assert "exists already" in labctl(location, "backup", str(target), status=2).stderr
    assert target.read_bytes() == content
    last = json.loads(labctl(location, "audit", "list", "--json").stdout)[-1]
    assert (last["action"], last["subject"]) == ("backup", "copy.sqlite")
    assert last["detail"]["sha256"] == answer["sha256"]
    assert "the folder does not exist" in labctl(location, "backup", str(tmp_path / "no" / "x"), status=2).stderr


def test_a_backup_beside_a_process_that_cannot_be_asked_is_made_all_the_same(
    store: Store, location: str, tmp_path: Path
) -> None:
    answer = labctl(location, "backup", str(tmp_path / "copy.sqlite"))
    assert "could not be noted" in answer.stderr
    assert check(str(tmp_path / "copy.sqlite")).findings == ()


def test_a_backup_of_what_is_damaged_says_so(location: str, tmp_path: Path) -> None:
    flip(location, checksum=False)
    said = labctl(location, "backup", str(tmp_path / "copy.sqlite"), status=1)
    assert "recording 1 data set 1 block 0" in said.stderr


def test_nothing_is_left_of_a_backup_that_fails(location: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device", "copy.sqlite")

    before = sorted(tmp_path.iterdir())
    monkeypatch.setattr("labctl.store.integrity.backup._synced_digest", full)
    assert "No space left on device" in labctl(location, "backup", str(tmp_path / "copy.sqlite"), status=2).stderr
    assert sorted(tmp_path.iterdir()) == before


def fill(store: Store, pages: int) -> None:
    """Let the disk be full once the database has grown by some pages."""
    with store.audit._database.writing() as connection:
        now = connection.exec_driver_sql("PRAGMA page_count").scalar_one()
        connection.exec_driver_sql(f"PRAGMA max_page_count={now + pages}")


def test_a_full_disk_is_one_clear_error_and_nothing_is_half_written(store: Store, location: str) -> None:
    before = [row.id for row in store.audit.rows()], [unit.serial for unit in store.units.all()]
    fill(store, 2)
    with pytest.raises(DiskFull, match="the disk is full; nothing was stored"):
        local_executor(store, VirtualClock()).execute(IMPORT_RECORDING, RecordingFolder(EXAMPLES / "osu-fog"))
    assert before == ([row.id for row in store.audit.rows()], [unit.serial for unit in store.units.all()])
    assert check(location).findings == ()
    fill(store, 1_000_000)
    local_executor(store, VirtualClock()).execute(IMPORT_RECORDING, RecordingFolder(EXAMPLES / "osu-fog"))
    assert check(location).findings == ()


def test_a_disk_that_fills_during_a_campaign_damages_nothing(tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    with open_store(location, write=True) as store:
        prepared = prepare(store, "short", load_bench("single-axis-sim"), VirtualClock(), clip=False)
        fill(store, 2)
        with pytest.raises(StoreError, match="the disk is full"):
            run(store, prepared)
        assert store.campaigns.get(prepared.id).state != "done"
        fill(store, 1_000_000)
        store.campaigns.close_unfinished(prepared.id, "the disk was full", AT)
    found = check(location)
    assert found.findings == ()
    assert found.blocks > 0


def test_an_old_recording_is_what_it_was(location: str) -> None:
    """Counting rows of a table of points needs no statistics beside it."""
    with open_store(location, write=False) as store:
        assert store.recordings.get(2).datasets == len(read_recording(EXAMPLES / "osu-fog"))
