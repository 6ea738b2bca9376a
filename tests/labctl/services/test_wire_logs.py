"""Every wire log of tests/wire_logs is replayed: the same requests, and the readings bit for bit."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import pytest

from labctl.errors import BadInput
from labctl.services.wire_replay import replay
from tests.helpers.lab import Lab
from tests.helpers.wire_sessions import FOLDER, MAX_BYTES, SUFFIX, own_drivers

FILES = sorted(FOLDER.glob(f"*{SUFFIX}"))
ONE = FOLDER / f"kvh-dsp3000{SUFFIX}"


def lines_of(file: Path) -> list[bytes]:
    return gzip.decompress(file.read_bytes()).splitlines(keepends=True)


def changed(file: Path, old: bytes, new: bytes, *, nth: int = 0) -> None:
    """Write a copy of `ONE` in which the n-th line that contains `old` has `new` in its place."""
    lines = lines_of(ONE)
    number = [n for n, line in enumerate(lines) if n and old in line][nth]
    lines[number] = lines[number].replace(old, new)
    file.write_bytes(gzip.compress(b"".join(lines)))


def test_there_is_a_session_of_each_driver_and_none_is_large() -> None:
    assert {file.name.removesuffix(SUFFIX) for file in FILES} >= set(own_drivers())
    assert [file.name for file in FILES if file.stat().st_size > MAX_BYTES] == []


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name.removesuffix(SUFFIX))
def test_a_replay_is_the_session(file: Path) -> None:
    answer = replay(file)
    assert (answer.difference, answer.remarks) == ("", [])
    assert answer.ok
    assert answer.whole
    assert answer.requests > 0
    assert answer.found == answer.recorded
    if answer.session == "campaign":
        assert answer.found is not None
        assert answer.found.readings > 0


def test_a_request_that_differs_is_said(tmp_path: Path) -> None:
    file = tmp_path / "other.jsonl.gz"
    changed(file, b'"did":"sent","text":"', b'"did":"sent","text":"X', nth=5)
    answer = replay(file)
    assert not answer.ok
    assert "request " in answer.difference
    assert "differs: the session sent 'X" in answer.difference
    assert "this replay sends '" in answer.difference


def test_another_reading_is_another_result(tmp_path: Path) -> None:
    file = tmp_path / "other.jsonl.gz"
    lines = lines_of(ONE)
    arrived = [n for n, line in enumerate(lines) if b'"arrived"' in line and b'"text"' in line]
    record = json.loads(lines[arrived[-3]])
    digits = record["text"]
    at = next(n for n in range(len(digits) - 1, 0, -1) if digits[n].isdigit() and digits[n - 1].isdigit())
    record["text"] = digits[:at] + str((int(digits[at]) + 1) % 10) + digits[at + 1 :]
    lines[arrived[-3]] = json.dumps(record).encode() + b"\n"
    file.write_bytes(gzip.compress(b"".join(lines)))
    answer = replay(file)
    assert not answer.ok
    assert answer.difference == ""
    assert answer.remarks[0].startswith("readings: ")


def test_a_log_that_was_cut_short_is_replayed_to_its_end(tmp_path: Path) -> None:
    file, data = tmp_path / "cut.jsonl.gz", ONE.read_bytes()
    file.write_bytes(data[: len(data) * 2 // 3])
    answer = replay(file)
    assert not answer.whole
    assert answer.recorded is None
    assert answer.difference.startswith("the log ends before request ")
    assert answer.ok


@pytest.mark.parametrize(
    "content",
    [b"", b"no gzip", gzip.compress(b"[]\n"), gzip.compress(b'{"format": "x/1"}\n')],
    ids=["empty", "no gzip", "a list", "another format"],  # a compressed file holds the time at which it was made
)
def test_a_file_that_is_no_wire_log_is_refused(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "file"
    file.write_bytes(content)
    with pytest.raises(BadInput, match=r"is no wire log of labctl: .*give a file that --wire-log wrote"):
        replay(file)


def test_a_check_of_a_bench_is_recorded_and_replayed(tmp_path: Path) -> None:
    lab, file = Lab(tmp_path), tmp_path / "check.jsonl.gz"
    lab.run("bench", "check", "single-axis-sim", "--wire-log", str(file))
    answer = lab.json("replay", str(file))
    assert answer["ok"]
    assert answer["session"] == "bench check"
    assert answer["requests"] > 10


def test_the_replay_command_prints_its_result(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    assert "equal to those of the session, bit for bit" in lab.run("replay", str(ONE)).stdout
    assert [each["id"] for each in lab.json("campaign", "list")] == [1]  # with --database it is kept


def test_a_file_that_cannot_be_written_is_refused_before_anything_moves(tmp_path: Path) -> None:
    result = Lab(tmp_path).run("campaign", "start", "short", "--wire-log", str(tmp_path / "no" / "folder.gz"), status=2)
    assert "--wire-log" in result.stderr + result.output
    assert "cannot be written" in result.stderr + result.output
