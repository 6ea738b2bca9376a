"""Where a stop finds the benches: the state folder, the folder of each bench, its note, and the process it names."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from labctl.stop import places
from labctl.stop.latch import StopRequest
from labctl.stop.places import (
    BenchPlace,
    DriverNote,
    ProcessId,
    folder_name,
    known_places,
    place_of,
    places_of,
    state_folder,
)


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.delenv("STATE_DIRECTORY", raising=False)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state" / "labctl"


@pytest.fixture
def place(tmp_path: Path) -> BenchPlace:
    return place_of(str(tmp_path / "lab.sqlite"), "b")


def mode(path: Path) -> int:
    return path.stat().st_mode & 0o777


@pytest.mark.parametrize(
    ("systemd", "xdg", "folder"),
    [
        ("/var/lib/labctl", "/state", "/var/lib/labctl"),
        ("/var/lib/labctl:/var/lib/other", "/state", "/var/lib/labctl"),
        ("", "/state", "/state/labctl"),
        ("", "state", "/home/ada/.local/state/labctl"),  # one that is not absolute is to be ignored
        ("", "", "/home/ada/.local/state/labctl"),
    ],
)
def test_the_state_folder_is_that_of_systemd_else_of_xdg_else_in_the_home_folder(
    monkeypatch: pytest.MonkeyPatch, systemd: str, xdg: str, folder: str
) -> None:
    monkeypatch.setenv("STATE_DIRECTORY", systemd)
    monkeypatch.setenv("XDG_STATE_HOME", xdg)
    monkeypatch.setenv("HOME", "/home/ada")
    assert state_folder() == Path(folder)


def test_the_folder_of_a_bench_is_beside_the_sqlite_file_whose_links_are_not_followed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "lab.sqlite").symlink_to(tmp_path / "other.sqlite")
    monkeypatch.chdir(tmp_path)
    assert place_of("lab.sqlite", "b").folder == tmp_path / "lab.sqlite.benches" / "b"


def test_a_bench_of_a_server_has_its_folder_in_the_state_folder_by_user_host_and_database(state: Path) -> None:
    """A release that named it otherwise would not find the latch of an earlier one."""
    named = hashlib.sha256(b"postgresql://ann@host/lab").hexdigest()[:16]
    assert place_of("postgresql://ann:secret@host/lab", "b").folder == state / "servers" / named / "b"
    assert place_of("postgresql://ann@host/lab", "b").folder == state / "servers" / named / "b"
    assert place_of("postgresql://bob@host/lab", "b").folder.parent.name != named


@pytest.mark.parametrize(
    ("bench", "name"), [("bench 1", "bench 1"), ("a/b", "a%2Fb"), ("..", "%2E%2E"), ("ü", "%C3%BC")]
)
def test_every_name_of_a_bench_is_one_folder_and_is_read_back(bench: str, name: str) -> None:
    assert folder_name(bench) == name
    assert BenchPlace(Path(name)).name == bench


def test_a_note_is_read_as_it_was_written_the_newest_counts_and_only_its_owner_reads_it(place: BenchPlace) -> None:
    notes = [
        DriverNote("b", ProcessId(5, 7, "boot"), "/run/stop", ProcessId(6, 8, "boot"), "/run/guardian"),
        DriverNote("b", simulated=True, document={"name": "b"}, left="bench b is safe", left_safe=True),
        DriverNote("b"),
    ]
    for note in notes:
        place.write_note(note)
        assert place.note() == note
    (file,) = place.folder.iterdir()
    assert json.loads(file.read_bytes()) == {
        "bench": "b", "socket": "", "guardian_socket": "", "simulated": False, "document": {}, "left": "",
        "left_safe": False, "driver": (none := {"pid": 0, "started": 0, "boot": ""}), "guardian": none,
    }  # fmt: skip
    assert (mode(file), mode(place.folder)) == (0o600, 0o700)


def test_the_latch_of_a_bench_is_in_its_folder(place: BenchPlace) -> None:
    stop = StopRequest.new("Ada", "key", "smoke")
    place.latch.request(stop)
    assert place_of(str(place.folder.parent).removesuffix(".benches"), "b").latch.state().open == (stop,)
    assert [file.parent for file in place.folder.iterdir()] == [place.folder]


@pytest.mark.parametrize(
    "content",
    [None, b"\xff", b"{", b"3", b"[]", b"{}", b'{"driver": 3}', b'{"driver": {}, "guardian": {}, "other": 1}'],
)
def test_a_note_that_is_not_there_or_cannot_be_read_is_none(place: BenchPlace, content: bytes | None) -> None:
    place.write_note(DriverNote("b"))
    (file,) = place.folder.iterdir()
    file.unlink() if content is None else file.write_bytes(content)
    assert place.note() is None


def test_a_note_that_cannot_be_written_leaves_the_one_before_and_nothing_else(place: BenchPlace) -> None:
    place.write_note(DriverNote("b", left="as before"))
    document: dict[str, Any] = {"no JSON": object()}
    with pytest.raises(TypeError):
        place.write_note(DriverNote("b", document=document))
    assert place.note() == DriverNote("b", left="as before")
    assert len(list(place.folder.iterdir())) == 1


def test_benches_that_were_registered_are_found_until_their_folder_is_gone(
    tmp_path: Path, place: BenchPlace, state: Path
) -> None:
    assert known_places() == []
    other = place_of(str(tmp_path / "lab.sqlite"), "another")
    for each in (place, other, other):
        each.write_note(DriverNote(each.name))
        each.register()
    pointers = sorted((state / "benches").iterdir())
    names = {f"{hashlib.sha256(str(each.folder).encode()).hexdigest()[:16]}.json" for each in (place, other)}
    assert {pointer.name for pointer in pointers} == names
    assert {mode(path) for path in (state / "benches", *pointers)} == {0o700, 0o600}
    assert set(known_places()) == {place, other}
    for number, damaged in enumerate((b"{", b"[]", b"{}")):
        (state / "benches" / f"{number}.json").write_bytes(damaged)
    assert set(known_places()) == {place, other}
    for file in (*place.folder.iterdir(), place.folder):
        file.unlink() if file.is_file() else file.rmdir()
    assert known_places() == [other]
    assert not names <= {pointer.name for pointer in (state / "benches").iterdir()}


def test_a_bench_that_cannot_be_registered_can_still_be_named(tmp_path: Path, place: BenchPlace, state: Path) -> None:
    state.parent.write_bytes(b"no folder")
    place.write_note(DriverNote("b"))
    place.register()
    assert known_places() == []
    assert places_of(str(tmp_path / "lab.sqlite")) == [place]


def test_the_benches_of_a_database_are_its_folders_in_the_order_of_their_names(tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    assert places_of(location) == []
    for name in ("b", "a"):
        place_of(location, name).write_note(DriverNote(name))
    (tmp_path / "lab.sqlite.benches" / "file").touch()
    assert [each.name for each in places_of(location)] == ["a", "b"]


def test_a_process_is_known_until_it_ends_also_while_it_stands_still_or_was_not_waited_for() -> None:
    process = subprocess.Popen([sys.executable, "-S", "-c", "import signal; signal.pause()"])
    try:
        named = ProcessId.of(process.pid)
        assert (named.pid, named.lives, named.stands_still) == (process.pid, True, False)
        assert 0.0 <= named.age_s < 30.0
        os.kill(process.pid, signal.SIGSTOP)
        os.waitpid(process.pid, os.WUNTRACED)
        assert (named.lives, named.stands_still) == (True, True)
        os.kill(process.pid, signal.SIGKILL)
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
        assert (named.lives, named.stands_still) == (False, False)
        assert ProcessId.of(process.pid) == ProcessId(0, 0, "")
    finally:
        process.kill()
        process.wait()
    assert ProcessId.of(process.pid) == ProcessId(0, 0, "")
    assert ProcessId().lives is False


def test_where_the_system_says_nothing_of_its_processes_none_is_taken_for_alive(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    mine = ProcessId.of(os.getpid())
    monkeypatch.setattr(places, "Path", lambda _: Path("/nowhere"))
    assert (mine.lives, mine.stands_still, mine.age_s) == (False, False, 0.0)
    assert ProcessId(mine.pid, mine.started, "").lives is False
    assert ProcessId.of(mine.pid) == ProcessId()
    monkeypatch.setattr(places, "_fields", lambda _: ["S"] * 19 + [str(mine.started)])
    assert ProcessId.of(mine.pid) == ProcessId(mine.pid, mine.started, "")
