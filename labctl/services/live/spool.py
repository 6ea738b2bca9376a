"""The recording of a live calibration on disk, from its first reading on.

It is a recording in the interchange format at every moment: what a process that was killed leaves is read by
`labctl import FOLDER`. Its folder is locked while it is in use.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import BinaryIO, Self

import numpy as np

from labctl.errors import BadInput
from labctl.recording import RecordingInfo
from labctl.recording.files import HEAD, head_of
from labctl.services.live.source import Block
from labctl.services.recordings.live_folders import SAMPLES, lock, unlock


class Spool:
    """A folder that is made with the first block, and is in use from then until the end of the context.

    Raises BadInput where it exists already and is not empty.
    """

    def __init__(self, folder: Path) -> None:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise BadInput(f"{folder}: exists already and is not empty; name a new folder with --out")
        self.folder = folder
        self.readings = self.damaged = 0
        self._example = ""
        self._info: RecordingInfo | None = None
        self._names: tuple[str, ...] = ()
        self._file: BinaryIO | None = None
        self._handle: int | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
        if self._handle is not None:
            unlock(self._handle)
            self._handle = None

    def add(self, info: RecordingInfo, block: Block) -> None:
        """Write a block down; it is on the disk when this returns. Raises OSError."""
        self.damaged += block.damaged
        self._example = self._example or block.example
        if not len(block):
            return
        if self._file is None:
            self._open(info, block)
        assert self._file is not None
        columns = [np.asarray(block.columns[name]).tolist() for name in self._names]
        rows = "".join("1," + ",".join(map(repr, row)) + "\n" for row in zip(*columns, strict=True))
        self._file.write(rows.encode())
        self._file.flush()
        os.fsync(self._file.fileno())
        self.readings += len(block)

    def close(self) -> None:
        """Close the file, and state in the head what of the stream could not be read. Safe to call twice."""
        if self._file is None or self._info is None:
            return
        self._file.close()
        self._file = None
        if self.damaged:
            share = self.damaged / (self.damaged + self.readings)
            text = f"{self.damaged} lines or frames of the stream could not be read"
            unread = f"{text}; the first: {self._example}" if self._example else text
            info = self._info.model_copy(update={"unread": unread, "unread_share": share})
            whole = self.folder / f".{HEAD}"
            whole.write_bytes(head_of(info))
            whole.replace(self.folder / HEAD)

    def _open(self, info: RecordingInfo, block: Block) -> None:
        self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        self._handle = lock(self.folder)
        self._info, self._names = info, tuple(block.columns)
        (self.folder / HEAD).write_bytes(head_of(info))
        self._file = (self.folder / SAMPLES).open("wb")
        self._file.write((",".join(["dataset", *self._names]) + "\n").encode())
