"""`labctl stop` step by step: which benches are meant, what is asked of each, what is printed. Nothing is stopped."""

from __future__ import annotations

import json
import os
import pwd
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from labctl.stop import program
from labctl.stop.client import StopResult
from labctl.stop.latch import StopRequest
from labctl.stop.places import BenchPlace, DriverNote, ProcessId, place_of
from labctl.stop.program import StopArguments, main, stop_all

WHY = "stopped from the command line"
REAL = {"name": "real", "table": {"port": "/dev/ttyUSB7"}}
SIMULATED = 'name = "copy"\n[table]\nport = "sim://arrick"\n'


def me() -> ProcessId:
    return ProcessId.of(os.getpid())


@dataclass
class Stops:
    """What a stop of a bench comes to, in place of the stop itself."""

    stands: bool = True
    latched: bool = True
    meanwhile: Callable[[], object] = lambda: None
    benches: list[str] = field(default_factory=list)
    requests: list[StopRequest] = field(default_factory=list)
    ages_s: list[float] = field(default_factory=list)
    notes: list[DriverNote] = field(default_factory=list)

    def stop_bench(self, place: BenchPlace, stop: StopRequest, say: Callable[[str], None], age_s: float) -> StopResult:
        self.benches.append(place.name)
        self.requests.append(stop)
        self.ages_s.append(age_s)
        self.meanwhile()
        return StopResult(place.name, self.stands, "the table is at rest", 7, self.latched)

    def at_instruments(self, note: DriverNote, say: Callable[[str], None]) -> StopResult:
        self.notes.append(note)
        say("nothing is printed of this")
        return StopResult("another name", self.stands, "stopped directly")


@pytest.fixture(autouse=True)
def stops(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Stops:
    made = Stops()
    monkeypatch.setattr(program, "stop_bench", made.stop_bench)
    monkeypatch.setattr(program, "at_instruments", made.at_instruments)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.delenv("STATE_DIRECTORY", raising=False)
    monkeypatch.delenv("LABCTL_DATABASE", raising=False)
    return made


@pytest.fixture
def location(tmp_path: Path) -> str:
    return str(tmp_path / "lab.sqlite")


def bench(location: str, name: str, *, registered: bool = True, **note: Any) -> BenchPlace:
    place = place_of(location, name)
    place.write_note(DriverNote(name, **note))
    if registered:
        place.register()
    return place


def written(tmp_path: Path, text: str) -> str:
    (tmp_path / "bench.toml").write_text(text)
    return str(tmp_path / "bench.toml")


def test_the_words_of_the_command_are_what_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[StopArguments] = []
    monkeypatch.setattr(program, "run", lambda request: asked.append(request) or 1)
    assert main([]) == 1
    main(["--bench", "b", "--database", "d", "--by", "Ada", "--reason", "smoke", "--json"])
    assert asked == [
        StopArguments(None, None, None, WHY, as_json=False),
        StopArguments("b", "d", "Ada", "smoke", as_json=True),
    ]
    assert StopArguments() == asked[0]


def test_every_bench_that_stands_is_printed_and_the_status_is_0(location: str, capsys: Any) -> None:
    bench(location, "a", driver=me())
    bench(location, "b", left="it is safe", left_safe=True)
    assert main([]) == 0
    printed = capsys.readouterr()
    assert set(printed.out.splitlines()) == {"bench a stands: the table is at rest", "bench b stands: it is safe"}
    assert printed.err == ""


def test_a_bench_that_does_not_stand_is_an_error_also_beside_one_that_does(
    location: str, stops: Stops, capsys: Any
) -> None:
    bench(location, "a", driver=me())
    bench(location, "b", left="it is safe", left_safe=True)
    stops.stands, stops.latched = False, False
    assert main([]) == 1
    printed = capsys.readouterr()
    assert printed.out == "bench b stands: it is safe\n"
    assert printed.err.splitlines()[0] == (
        "labctl: NOT STOPPED: bench a: the table is at rest. Use the stop switch of the bench."
    )
    assert printed.err.splitlines()[1].startswith("labctl: bench a: the stop could not be written down")
    assert len(printed.err.splitlines()) == 2


@pytest.mark.parametrize("stands", [True, False])
def test_json_alone_is_on_standard_output_and_complaints_stay_on_the_other(
    location: str, stops: Stops, capsys: Any, stands: bool
) -> None:
    bench(location, "a", driver=me())
    stops.stands = stands
    assert main(["--json"]) == int(not stands)
    printed = capsys.readouterr()
    found = {"bench": "a", "stands": stands, "text": "the table is at rest", "campaign": 7, "latched": True}
    assert json.loads(printed.out) == {"stands": stands, "benches": [found]}
    assert ("NOT STOPPED" in printed.err) is not stands
    assert "\n  " in printed.out  # for people too


def test_without_any_bench_nothing_is_called_stopped(capsys: Any) -> None:
    assert main(["--json"]) == 1
    printed = capsys.readouterr()
    assert json.loads(printed.out) == {"stands": False, "benches": []}
    assert printed.err.startswith("labctl: NOT STOPPED: labctl knows of no bench")


def test_benches_are_stopped_at_the_same_time_and_reported_in_the_order_of_their_names(
    location: str, stops: Stops
) -> None:
    for name in ("a", "b", "c"):
        bench(location, name, driver=me(), registered=False)
    every, begun = threading.Barrier(3, timeout=5.0), list[threading.Thread]()
    stops.meanwhile = lambda: (begun.append(threading.current_thread()), every.wait())
    results = stop_all(StopArguments(database=location, by="Ada", reason="smoke"))
    assert [(result.bench, result.stands) for result in results] == [("a", True), ("b", True), ("c", True)]
    assert all(thread.daemon for thread in begun)  # a second Ctrl-C ends the command
    (request,) = set(stops.requests)
    assert (request.by, request.reason, request.campaign) == ("Ada", "smoke (Ada)", None)


def test_the_age_of_the_command_counts_for_what_it_says_late(location: str, stops: Stops) -> None:
    bench(location, "a", driver=me())
    stop_all(StopArguments())
    assert stops.ages_s == [pytest.approx(me().age_s, abs=10.0)]
    assert stops.ages_s[0] > 0.0


def test_who_stops_is_the_user_of_the_system_else_its_number(
    location: str, stops: Stops, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench(location, "a", driver=me())
    stop_all(StopArguments())
    user = pwd.getpwuid(os.getuid()).pw_name
    assert (stops.requests[0].by, stops.requests[0].reason) == (user, f"{WHY} ({user})")
    monkeypatch.setattr(pwd, "getpwuid", lambda number: {}[number])
    stop_all(StopArguments())
    assert stops.requests[1].by == f"uid {os.getuid()}"


@pytest.mark.parametrize(
    ("note", "text"),
    [
        ({"left": "it is safe", "left_safe": True}, "it is safe"),
        ({"simulated": True}, "its simulated instruments ended with their process"),
        ({"simulated": True, "left": "it ended"}, "it ended"),
        ({"left": "no answer", "left_safe": False}, None),
        ({"left": "it is safe", "left_safe": True, "driver": me()}, None),
        ({"left": "it is safe", "left_safe": True, "guardian": me()}, None),
        ({"simulated": True, "driver": me()}, None),
    ],
)
def test_a_bench_that_was_left_safe_is_only_reported_where_no_process_has_it(
    location: str, stops: Stops, note: dict[str, Any], text: str | None
) -> None:
    bench(location, "a", **note)
    (result,) = stop_all(StopArguments())
    assert (result.stands, result.text) == (True, text or "the table is at rest")
    assert stops.benches == ([] if text else ["a"])


def test_a_bench_without_a_note_is_stopped(location: str, stops: Stops) -> None:
    place_of(location, "a").folder.mkdir(parents=True)
    stop_all(StopArguments(database=location))
    assert stops.benches == ["a"]


def test_benches_are_those_of_the_database_that_is_named_else_all_that_are_known_each_once(
    location: str, tmp_path: Path, stops: Stops, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = str(tmp_path / "other.sqlite")
    bench(location, "of the first", driver=me())
    bench(other, "of the other", driver=me(), registered=False)
    stop_all(StopArguments(database=other))
    assert stops.benches == ["of the other"]
    stop_all(StopArguments())
    assert stops.benches[1:] == ["of the first"]
    monkeypatch.setenv("LABCTL_DATABASE", f" {other} ")
    stop_all(StopArguments())
    assert sorted(stops.benches[2:]) == ["of the first", "of the other"]
    monkeypatch.setenv("LABCTL_DATABASE", location)
    stop_all(StopArguments())
    assert stops.benches[4:] == ["of the first"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "cannot be read"),
        ("name = ", "cannot be read"),
        ("name = 3\n", "the file has no name"),
        ("", "the file has no name"),
    ],
)
def test_a_bench_file_that_cannot_be_used_is_wrong_use_and_stops_nothing(
    tmp_path: Path, stops: Stops, capsys: Any, text: str | None, said: str
) -> None:
    file = str(tmp_path / "nowhere.toml") if text is None else written(tmp_path, text)
    assert main(["--bench", file]) == 2
    printed = capsys.readouterr()
    assert printed.err.startswith(f"labctl: --bench {file}: ")
    assert said in printed.err
    assert (stops.benches, stops.notes, printed.out) == ([], [], "")


def test_only_the_bench_that_is_meant_is_stopped_by_its_name_or_its_table(
    location: str, tmp_path: Path, stops: Stops
) -> None:
    bench(location, "real", driver=me(), document=REAL)
    bench(location, "simulated", driver=me(), simulated=True, document=REAL)
    bench(location, "another", driver=me(), document={"table": {"host": "10.0.0.7"}})
    bench(location, "no table", driver=me(), document={"name": "no table"})
    place_of(location, "no note").folder.mkdir(parents=True)
    place_of(location, "no note").register()
    for text, meant in (
        ('name = "real"\n', ["real"]),
        ('name = "simulated"\n', ["simulated"]),
        ('name = "no note"\n', ["no note"]),
        ('name = "x"\n[table]\nport = "/dev/ttyUSB7"\n', ["real"]),
        ('name = "x"\n[table]\nhost = "10.0.0.7"\n', ["another"]),
        ('name = "x"\n[table]\nhost = "10.0.0.7"\ntcp_port = 502\n', ["another"]),
        ('name = "x"\n[table]\nhost = "10.0.0.7"\ntcp_port = 503\n', []),
        ('name = "x"\n[table]\nport = "/dev/ttyUSB8"\n', []),
        ('name = "x"\n', []),
    ):
        stops.benches.clear()
        stop_all(StopArguments(bench=written(tmp_path, text)))
        assert (text, stops.benches) == (text, meant)


def test_a_bench_that_no_process_has_driven_is_stopped_at_its_instruments(
    location: str, tmp_path: Path, stops: Stops
) -> None:
    file = written(tmp_path, 'name = "x"\n[table]\nport = "/dev/ttyUSB7"\n')
    assert stop_all(StopArguments(bench=file)) == [StopResult("x", True, "stopped directly")]
    (note,) = stops.notes
    assert (note.bench, note.document["name"], note.driver) == ("x", "x", ProcessId())
    stops.stands = False
    assert stop_all(StopArguments(bench=written(tmp_path, 'name = "x"\n'))) == [
        StopResult("x", False, "stopped directly")
    ]
    assert stop_all(StopArguments(bench=written(tmp_path, SIMULATED))) == [
        StopResult("copy", True, "its instruments are simulated, and no process runs it")
    ]
    assert len(stops.notes) == 2


def test_the_bench_file_is_read_as_the_service_reads_it_where_that_is_possible(tmp_path: Path, stops: Stops) -> None:
    stop_all(StopArguments(bench="example-real"))  # a shipped one, by its name
    stop_all(StopArguments(bench=written(tmp_path, 'name = "x"\n[table]\nport = "/dev/ttyUSB7"\ndriver = 3\n')))
    complete, as_it_is = (note.document for note in stops.notes)
    assert (complete["name"], complete["standards"]) == ("my-bench", [])  # the file has no line for standards
    assert as_it_is == {"name": "x", "table": {"port": "/dev/ttyUSB7", "driver": 3}}


def test_a_stop_of_a_bench_that_no_process_has_driven_is_latched_where_its_database_is_named(
    location: str, tmp_path: Path
) -> None:
    file = written(tmp_path, 'name = "x"\n[table]\nport = "/dev/ttyUSB7"\n')
    (result,) = stop_all(StopArguments(bench=file, database=location, by="Ada"))
    assert result.latched is True
    assert [stop.by for stop in place_of(location, "x").latch.state().open] == ["Ada"]
    (tmp_path / "full.sqlite.benches").write_bytes(b"no folder")
    (result,) = stop_all(StopArguments(bench=file, database=str(tmp_path / "full.sqlite")))
    assert (result.stands, result.latched) == (True, False)
