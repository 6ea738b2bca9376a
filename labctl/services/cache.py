"""Result caches: files in the user's cache folder, and a few results in memory.

A cached file is named by all that its result depends on, the code included, so it never has to be invalidated. A file
or a folder that is damaged, missing or not writable only costs the time to compute the result again.
"""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Generic, TypeVar
from zipfile import BadZipFile

from platformdirs import user_cache_path

from instruments.plugins import installed
from labctl.answers.base import ResponseModel
from labctl.services.single_flight import single_flight
from labctl.store.connection.private_files import make_private_folder

ResponseT = TypeVar("ResponseT", bound=ResponseModel)
ResultT = TypeVar("ResultT")
PACKAGES = ("instruments", "labctl", "procedures")
LIBRARIES = ("numpy", "scipy")
#: What a damaged file raises while it is read.
DAMAGED = (OSError, EOFError, ValueError, KeyError, BadZipFile)


#: The question of a long computation without a cache: only an identical request has the same one.
UNNAMED = ""


class NotCached(Exception):
    """The result is not cached, and computing it was not wanted; `question` is the same for all of one work's results.

    Not a LabctlError: what handles a failed part of a computation must not take it for one.
    """

    def __init__(self, question: str) -> None:
        super().__init__(question)
        self.question = question


_cached_only: ContextVar[bool] = ContextVar("cached_only", default=False)


@contextmanager
def cached_only() -> Iterator[None]:
    """Start no long computation while the block runs: it raises NotCached instead."""
    token = _cached_only.set(True)
    try:
        yield
    finally:
        _cached_only.reset(token)


def compute(question: str) -> None:
    """Announce a long computation. Raises NotCached where only cached results are wanted."""
    if _cached_only.get():
        raise NotCached(question)


class FileCache:
    """Files of one kind in a folder of the user's cache; of them only the `most` used last stay."""

    def __init__(self, folder: str, suffix: str, most: int) -> None:
        self._folder, self._suffix, self.most = folder, suffix, most

    def file(self, question: Mapping[str, object]) -> Path:
        """Return the file of the result of a question (JSON values), as the present code answers it."""
        question_json = json.dumps({"by": code_digest(), **question}, sort_keys=True)
        name = hashlib.sha256(question_json.encode()).hexdigest()
        return user_cache_path("labctl") / self._folder / f"{name}{self._suffix}"

    def load(self, file: Path, decode: Callable[[bytes], ResultT]) -> ResultT | None:
        """Return what a file holds; None where it is missing or damaged."""
        with suppress(*DAMAGED):
            decoded = decode(file.read_bytes())
            file.touch()
            return decoded
        return None

    def save(self, file: Path, content: bytes) -> None:
        """Write a file whole or not at all, and remove the oldest; nothing where the folder cannot be written."""
        with suppress(OSError):
            make_private_folder(file.parent.parent)
            make_private_folder(file.parent)
            with NamedTemporaryFile("wb", dir=file.parent, suffix=".part", delete=False) as part:
                part.write(content)
            Path(part.name).replace(file)
            oldest_first = sorted(file.parent.iterdir(), key=lambda path: path.stat().st_mtime)
            for old in oldest_first[: -self.most]:
                old.unlink(missing_ok=True)

    def get(
        self, question: Mapping[str, object], decode: Callable[[bytes], ResultT], make: Callable[[], bytes]
    ) -> ResultT:
        """Return the result of a question, made only when it is not cached yet; other threads wait for it."""
        file = self.file(question)
        if (stored := self.load(file, decode)) is not None:
            return stored
        compute(str(file))
        with single_flight(str(file)):
            if (stored := self.load(file, decode)) is not None:
                return stored
            content = make()
            self.save(file, content)
        return decode(content)


#: A response has some 200 kB.
RESPONSES = FileCache("answers", ".json", most=400)


def cached(kind: type[ResponseT], question: Mapping[str, object], work: Callable[[], ResponseT]) -> ResponseT:
    """Return the response to a question (JSON values), computed by `work` only when it is not cached yet."""
    return cached_group(kind, question, lambda: [work()])


def cached_here(kind: type[ResponseT], question: Mapping[str, object], work: Callable[[], ResponseT]) -> ResponseT:
    """Return a response as `cached` does, for `work` of less than 0.2 s: the caller does it, no worker process."""
    file = RESPONSES.file({"kind": kind.__name__, **question})
    response = RESPONSES.load(file, kind.model_validate_json)
    if response is None:
        response = work()
        RESPONSES.save(file, response.model_dump_json().encode())
    return response


def cached_group(
    kind: type[ResponseT], question: Mapping[str, object], work: Callable[[], Sequence[ResponseModel]]
) -> ResponseT:
    """Return the response of one kind where `work` makes responses of several kinds at once; all are cached.

    A thread that asks the same question meanwhile, also for another kind, waits for that work.
    """

    def file(of: type[ResponseModel]) -> Path:
        return RESPONSES.file({"kind": of.__name__, **question})

    if (response := RESPONSES.load(file(kind), kind.model_validate_json)) is not None:
        return response
    question_json = json.dumps(question, sort_keys=True)
    compute(question_json)
    with single_flight(question_json):
        if (response := RESPONSES.load(file(kind), kind.model_validate_json)) is not None:
            return response
        # A fresh response takes the same way through JSON as a cached one, so both are equal.
        content_by_type = {type(each): each.model_dump_json() for each in work()}
        for each, text in content_by_type.items():
            RESPONSES.save(file(each), text.encode())
        return kind.model_validate_json(content_by_type[kind])


class RecentResults(Generic[ResultT]):
    """The `most` results used last, in memory; for any number of threads."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._found: dict[str, ResultT] = {}
        self._guard = threading.Lock()

    def get(self, question: str, work: Callable[[], ResultT]) -> ResultT:
        """Return the result of a question, computed once also when several threads ask at the same time."""
        with single_flight(f"{id(self)} {question}"):  # a cached response may be computed from it: another flight
            with self._guard:
                result = self._found.pop(question, None)
            if result is None:
                result = work()
            with self._guard:
                self._found[question] = result
                for old in list(self._found)[: -self._most]:
                    del self._found[old]
        return result


@lru_cache(maxsize=1)
def code_digest() -> str:
    """Return a digest of the code that computes results, of its libraries, and of what other packages add.

    An effect or an experiment of another package changes what a criticism answers.
    """
    digest = hashlib.sha256(" ".join(version(name) for name in LIBRARIES).encode())
    digest.update("\n".join(map(str, installed())).encode())
    for source in _sources():
        digest.update(source.read_bytes())
    return digest.hexdigest()


def _sources() -> Iterator[Path]:
    home = Path(__file__).resolve().parents[2]
    for package in PACKAGES:
        yield from sorted((home / package).rglob("*.py"))
