"""Folders for files on their way: private, locked while they are used, and removed when their process is gone."""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from pathlib import Path
from subprocess import PIPE, Popen
from typing import Any

import pytest

from labctl.errors import BadRecording
from labctl.services.recordings.staging import PREFIX, remove_abandoned, staging_folder
from labctl.services.recordings.transfer import import_files
from tests.helpers.service import open_client

#: Stages a folder, says where, and waits to be killed.
KILLED = """
import sys
from labctl.services.recordings.staging import staging_folder
with staging_folder() as folder:
    (folder / "samples.csv").write_text("t_s")
    print(folder, flush=True)
    sys.stdin.read()
"""


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    return folder


def killed() -> Popen[str]:
    return Popen([sys.executable, "-c", KILLED], stdin=PIPE, stdout=PIPE, text=True)


def test_a_folder_is_private_and_goes_at_the_end(temporary: Path) -> None:
    with staging_folder() as folder:
        assert (folder.parent, stat.S_IMODE(folder.stat().st_mode)) == (temporary, 0o700)
        (folder / "samples.csv").write_text("t_s", encoding="utf-8")
    assert list(temporary.iterdir()) == []


def test_what_a_killed_process_left_is_removed_and_what_is_used_stays(temporary: Path, tmp_path: Path) -> None:
    with killed() as child, staging_folder() as mine:
        assert child.stdout is not None
        left = Path(child.stdout.readline().strip())
        assert remove_abandoned() == []
        assert (left / "samples.csv").exists()
        child.kill()
        child.wait()
        with open_client(tmp_path / "lab.sqlite"):
            assert not left.exists()
        assert mine.exists()
    assert list(temporary.iterdir()) == []


def test_only_ours_are_removed(temporary: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (temporary / "another-program-x").mkdir()
    (temporary / f"{PREFIX}link").symlink_to(elsewhere)
    (temporary / f"{PREFIX}file").write_text("", encoding="utf-8")
    assert remove_abandoned() == []
    (temporary / f"{PREFIX}foreign").mkdir()
    with monkeypatch.context() as patched:
        patched.setattr(os, "getuid", lambda: 4242)
        assert remove_abandoned() == []
    assert remove_abandoned() == [temporary / f"{PREFIX}foreign"]
    assert elsewhere.exists()


def test_an_upload_leaves_nothing_behind(temporary: Path) -> None:
    seen: list[list[str]] = []

    def import_from(folder: Path) -> Any:
        seen.append([path.name for path in folder.iterdir()])
        raise BadRecording(f"{folder}/samples.csv: wrong")

    with (temporary.parent / "samples.csv").open("w+b") as content, pytest.raises(BadRecording, match=r"^samples\.csv"):
        import_files([("samples.csv", content)], import_from)
    assert (seen, list(temporary.iterdir())) == ([["samples.csv"]], [])
