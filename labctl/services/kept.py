"""Answers that take seconds, kept in the user's cache folder: nothing is worked out twice by the same code from the
same readings.

A kept answer is named by all that it depends on, so it never has to be told that something changed; whatever is wrong
with a file or a folder only costs the time to work the answer out again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import TypeVar

from platformdirs import user_cache_path

from labctl.services.answers import Answer

A = TypeVar("A", bound=Answer)
ROOMS = ("instruments", "labctl", "procedures")
LIBRARIES = ("numpy", "scipy")
#: The oldest go when there are more; an answer has some 200 kB.
MOST = 200


def kept(kind: type[A], question: Mapping[str, object], work: Callable[[], A]) -> A:
    """Return the answer to a question (JSON values), worked out by `work` only when it is not kept yet."""
    asked = json.dumps({"by": _code(), "kind": kind.__name__, **question}, sort_keys=True)
    file = user_cache_path("labctl") / "answers" / f"{hashlib.sha256(asked.encode()).hexdigest()}.json"
    with suppress(OSError, ValueError):
        answer = kind.model_validate_json(file.read_bytes())
        file.touch()
        return answer
    # What is kept is what is said, also the first time: one way through JSON, one answer.
    said = work().model_dump_json()
    with suppress(OSError):
        _write(file, said)
    return kind.model_validate_json(said)


def _write(file: Path, text: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    with NamedTemporaryFile("w", dir=file.parent, suffix=".part", delete=False, encoding="utf-8") as part:
        part.write(text)
    Path(part.name).replace(file)
    oldest_first = sorted(file.parent.iterdir(), key=lambda path: path.stat().st_mtime)
    for old in oldest_first[:-MOST]:
        old.unlink(missing_ok=True)


@lru_cache(maxsize=1)
def _code() -> str:
    """Return a digest of the code that answers, and of the libraries it calculates with."""
    digest = hashlib.sha256(" ".join(version(name) for name in LIBRARIES).encode())
    for source in _sources():
        digest.update(source.read_bytes())
    return digest.hexdigest()


def _sources() -> Iterator[Path]:
    home = Path(__file__).resolve().parents[2]
    for room in ROOMS:
        yield from sorted((home / room).rglob("*.py"))
