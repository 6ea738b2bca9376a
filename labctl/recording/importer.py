"""An importer, as an entry point of `labctl.importers` gives it: a file of another format becomes a recording."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field

from labctl.recording.raw_table import RawTable
from labctl.recording.recording import Recording


class NoOptions(BaseModel):
    """Options of an importer that has none."""

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True)


class TableOptions(BaseModel):
    """Options of an importer that returns a table; the rest is in its column map."""

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True)

    serial: str | None = Field(default=None, max_length=64)  #: instead of the map's or the file's
    started_at: AwareDatetime | None = None  #: instant of the first reading, instead of the map's or the file's


OptionsT = TypeVar("OptionsT", bound=BaseModel)
TableOptionsT = TypeVar("TableOptionsT", bound=TableOptions)


@dataclass(frozen=True)
class Importer(Generic[OptionsT]):
    """Reads one format.

    `probe` says how sure it is, 0 to 1 or a truth value, that a file or folder is of its format; it reads the
    beginning only, also of files that are not of its format. `read` returns the recording, and raises BadRecording
    naming file, row and what was expected; labctl then checks the recording by the rules of the interchange format.
    """

    title: str  #: what a message calls the format
    probe: Callable[[Path], float]
    read: Callable[[Path, OptionsT], Recording]
    options: type[OptionsT]  #: a pydantic model; NoOptions for none


@dataclass(frozen=True)
class TableImporter(Generic[TableOptionsT]):
    """Reads one format of logs as a table, of which a column map then makes a recording.

    `probe` is as of an Importer. `table` returns the columns under the file's own names, with the units that the
    format itself fixes, and raises BadRecording.
    """

    title: str
    probe: Callable[[Path], float]
    table: Callable[[Path, TableOptionsT], RawTable]
    options: type[TableOptionsT]
