"""The records of a log that a test has written into a file."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from labctl.log.setup import running_log

Record = dict[str, Any]


class Records:
    """What was logged so far."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def all(self) -> list[Record]:
        """Return every record, in order; each line is a JSON document."""
        return [json.loads(line) for line in self.path.read_text(encoding="utf-8").splitlines()]

    def named(self, event: str) -> list[Record]:
        """Return the records of one kind."""
        return [record for record in self.all() if record["event"] == event]

    def events(self) -> list[str]:
        """Return what every record is of."""
        return [record["event"] for record in self.all()]


@contextmanager
def logged(folder: Path, level: int = logging.INFO) -> Iterator[Records]:
    """Log into a file while the block runs; all of it is there afterwards."""
    path = folder / "log"
    with path.open("ab") as file, running_log("test", level, descriptor=file.fileno()):
        yield Records(path)
