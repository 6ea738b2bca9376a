"""Answers that take seconds, kept in the user's cache folder: nothing is worked out twice by the same code from the
same readings.

A kept answer is named by all that it depends on, so it never has to be told that something changed; whatever is wrong
with a file or a folder only costs the time to work the answer out again.
"""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import TypeVar
from weakref import WeakValueDictionary

from platformdirs import user_cache_path

from labctl.services.schemas.base import ResponseModel

A = TypeVar("A", bound=ResponseModel)
ROOMS = ("instruments", "labctl", "procedures")
LIBRARIES = ("numpy", "scipy")
#: The oldest go when there are more; an answer has some 200 kB.
MOST = 400


def cached(kind: type[A], question: Mapping[str, object], work: Callable[[], A]) -> A:
    """Return the answer to a question (JSON values), worked out by `work` only when it is not kept yet."""
    return cached_group(kind, question, lambda: [work()])


def cached_group(kind: type[A], question: Mapping[str, object], work: Callable[[], Sequence[ResponseModel]]) -> A:
    """Return the answer of one kind where one work gives answers of several: all of them are kept.

    Whoever asks the same question meanwhile, also for another kind, waits for that work instead of doing it again.
    """
    file = _file(kind, question)
    if (answer := _read(kind, file)) is not None:
        return answer
    with single_flight(json.dumps(question, sort_keys=True)):
        if (answer := _read(kind, file)) is not None:
            return answer
        # What is kept is what is said, also the first time: one way through JSON, one answer.
        said = {type(each): each.model_dump_json() for each in work()}
        for each, text in said.items():
            with suppress(OSError):
                write_cached(_file(each, question), text.encode(), MOST)
        return kind.model_validate_json(said[kind])


def _file(kind: type[ResponseModel], question: Mapping[str, object]) -> Path:
    asked = json.dumps({"by": code_digest(), "kind": kind.__name__, **question}, sort_keys=True)
    return user_cache_path("labctl") / "answers" / f"{hashlib.sha256(asked.encode()).hexdigest()}.json"


def _read(kind: type[A], file: Path) -> A | None:
    with suppress(OSError, ValueError):
        answer = kind.model_validate_json(file.read_bytes())
        file.touch()
        return answer
    return None


class _Turn:
    """A lock that can be forgotten when nobody holds it."""

    def __init__(self) -> None:
        self.lock = threading.Lock()


_turns: WeakValueDictionary[str, _Turn] = WeakValueDictionary()
_turns_guard = threading.Lock()


@contextmanager
def single_flight(asked: str) -> Iterator[None]:
    """Let one thread of this process at a time work at the same question."""
    with _turns_guard:
        turn = _turns.setdefault(asked, _Turn())
    with turn.lock:
        yield


def write_cached(file: Path, content: bytes, most: int) -> None:
    """Write a file whole or not at all; of its folder's files only the `most` used last stay. Raises OSError."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with NamedTemporaryFile("wb", dir=file.parent, suffix=".part", delete=False) as part:
        part.write(content)
    Path(part.name).replace(file)
    oldest_first = sorted(file.parent.iterdir(), key=lambda path: path.stat().st_mtime)
    for old in oldest_first[:-most]:
        old.unlink(missing_ok=True)


@lru_cache(maxsize=1)
def code_digest() -> str:
    """Return a digest of the code that answers, and of the libraries it calculates with."""
    digest = hashlib.sha256(" ".join(version(name) for name in LIBRARIES).encode())
    for source in _sources():
        digest.update(source.read_bytes())
    return digest.hexdigest()


def _sources() -> Iterator[Path]:
    home = Path(__file__).resolve().parents[2]
    for room in ROOMS:
        yield from sorted((home / room).rglob("*.py"))
