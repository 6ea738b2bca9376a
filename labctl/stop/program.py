"""`labctl stop`: stop every bench of this user, or one, by whatever still lives. Needs the standard library alone.

Exit status 0: every bench stands. 1: one does not, or that is not known. 2: wrong use.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
import threading
import tomllib
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from labctl.stop.client import NOT_STOPPED, SWITCH, StopResult, at_instruments, stop_bench
from labctl.stop.latch import StopRequest
from labctl.stop.places import BenchPlace, DriverNote, ProcessId, folder_name, known_places, place_of, places_of

DATABASE_VARIABLE = "LABCTL_DATABASE"
WHY = "stopped from the command line"


class WrongUse(Exception):
    """The command cannot be carried out as it was given."""


@dataclass(frozen=True)
class StopArguments:
    """What the command line asks for."""

    bench: str | None = None
    database: str | None = None
    by: str | None = None
    reason: str = WHY
    as_json: bool = False


def main(words: Sequence[str]) -> int:
    """Carry out `labctl stop WORDS`; returns the exit status."""
    parser = argparse.ArgumentParser(prog="labctl stop", description="Stop the bench, whatever of labctl still lives.")
    parser.add_argument("--bench", metavar="FILE", help="stop this bench only: bench file or name")
    parser.add_argument("--database", metavar="URL_OR_PATH", help="stop the benches of this database only")
    parser.add_argument("--by", metavar="NAME", help="who stops; default: the user who is logged in")
    parser.add_argument("--reason", metavar="TEXT", default=WHY, help="reason, for the audit trail")
    parser.add_argument("--json", action="store_true", dest="as_json", help="print one JSON document")
    return run(StopArguments(**vars(parser.parse_args(words))))


def run(request: StopArguments) -> int:
    """Stop what was asked for, print the result; returns the exit status."""
    try:
        results = stop_all(request)
    except WrongUse as error:
        _say(str(error))
        return 2
    stands = bool(results) and all(result.stands for result in results)
    if request.as_json:
        document = {"stands": stands, "benches": [asdict(result) for result in results]}
        sys.stdout.write(json.dumps(document, indent=2) + "\n")
    for result in results:
        _print(result, quiet=request.as_json)
    if not results:
        _say(
            f"{NOT_STOPPED}: labctl knows of no bench that this user has driven. {SWITCH}, or name the bench file: "
            "labctl stop --bench FILE"
        )
    return 0 if stands else 1


def _say(text: str) -> None:
    sys.stderr.write(f"labctl: {text}\n")


def _print(result: StopResult, *, quiet: bool) -> None:
    if not result.stands:
        _say(f"{NOT_STOPPED}: bench {result.bench}: {result.text}. {SWITCH}.")
    elif not quiet:
        sys.stdout.write(f"bench {result.bench} stands: {result.text}\n")
    if not result.latched:
        _say(
            f"bench {result.bench}: the stop could not be written down, so that a process that starts later does not "
            "know of it; do not start one before the bench was inspected"
        )


def stop_all(request: StopArguments) -> list[StopResult]:
    """Stop every bench that is meant, all at the same time. Raises WrongUse."""
    document = None if request.bench is None else _document(request.bench)
    places = [place for place in _places(request.database) if document is None or _is(place, document)]
    by = request.by or _user()
    stop = StopRequest.new(by, "command line", f"{request.reason} ({by})")
    if document is not None and not places:
        return [_unknown(request, document, stop)]
    results: dict[int, StopResult] = {}

    def one(number: int, place: BenchPlace) -> None:
        results[number] = _stop(place, stop)

    threads = [threading.Thread(target=one, args=each, daemon=True) for each in enumerate(places)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return [results[number] for number in sorted(results)]


def _stop(place: BenchPlace, stop: StopRequest) -> StopResult:
    """Stop one bench; one that no process drives and that was left safe is only reported."""
    note = place.note()
    if note is not None and not note.driver.lives and not note.guardian.lives and (note.left_safe or note.simulated):
        return StopResult(note.bench, True, note.left or "its simulated instruments ended with their process")
    return stop_bench(place, stop, _say, ProcessId.of(os.getpid()).age_s)


def _places(database: str | None) -> list[BenchPlace]:
    if database is not None:
        return places_of(database)
    named = os.environ.get(DATABASE_VARIABLE, "").strip()
    return list(dict.fromkeys([*(places_of(named) if named else []), *known_places()]))


def _document(source: str) -> dict[str, Any]:
    """Return a bench file by its path or its shipped name. Raises WrongUse."""
    path = Path(source)
    if not path.exists():
        import instruments  # noqa: PLC0415  only a name needs it

        path = Path(str(instruments.__file__)).parent / "benches" / f"{source}.toml"
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise WrongUse(f"--bench {source}: cannot be read ({error}); name a bench file or a shipped bench") from error
    if not isinstance(document.get("name"), str):
        raise WrongUse(f"--bench {source}: the file has no name; name a bench file or a shipped bench")
    return document


def _is(place: BenchPlace, document: dict[str, Any]) -> bool:
    """Return whether a folder is that of a bench: by its name, or because it has the same table."""
    note = place.note()
    if note is None:
        return place.folder.name == folder_name(document["name"])
    return note.bench == document["name"] or (
        not note.simulated and _table(document) is not None and _table(document) == _table(note.document)
    )


def _table(document: dict[str, Any]) -> tuple[Any, ...] | None:
    """Return where the table of a bench is; None without one, or for one that is simulated."""
    section = document.get("table") or {}
    address = section.get("port") or section.get("host")
    return None if not address or str(address).startswith("sim://") else (address, section.get("tcp_port", 502))


def _unknown(request: StopArguments, document: dict[str, Any], stop: StopRequest) -> StopResult:
    """Stop a bench that no process of this user has driven, at its instruments."""
    name = document["name"]
    if _table(document) is None and "table" in document:
        return StopResult(name, True, "its instruments are simulated, and no process runs it")
    latched = _latched(place_of(request.database, name), stop) if request.database else True
    with contextlib.suppress(ImportError):
        from instruments.bench_config import read_bench  # noqa: PLC0415  it loads the libraries of the drivers

        with contextlib.suppress(Exception):
            document = read_bench(str(request.bench)).model_dump(mode="json")
    result = at_instruments(DriverNote(name, document=document), lambda _: None)
    return StopResult(name, result.stands, result.text, None, latched)


def _latched(place: BenchPlace, stop: StopRequest) -> bool:
    try:
        place.latch.request(stop)
    except OSError:
        return False
    return True


def _user() -> str:
    import pwd  # noqa: PLC0415

    try:
        return pwd.getpwuid(os.getuid()).pw_name
    except KeyError:
        return f"uid {os.getuid()}"
