"""A live calibration from its stream to the database: a recording in any case, and a version when it is complete."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Self

import numpy as np

from instruments.errors import InstrumentError
from labctl.answers.calibrations import FitRequest, FitResponse
from labctl.answers.live import LiveResponse
from labctl.errors import BadInput, LabctlError
from labctl.fitting.live import LiveCalibration, LiveState, Target
from labctl.fitting.models.presets import POSES
from labctl.recording import RecordingInfo
from labctl.recording.files import HEAD, head_of
from labctl.services.commands.command import CommandExecutor
from labctl.services.commands.registry import FIT, IMPORT_RECORDING
from labctl.services.commands.requests import RecordingFolder, ToUnit
from labctl.services.live.assessor import Assessor
from labctl.services.live.figures import figures_of
from labctl.services.live.source import Block, LiveSource, Reason, StreamEnded
from labctl.services.recordings.live_folders import SAMPLES, lock, unlock

# The recording of a live calibration on disk, from its first reading on.
#
# It is a recording in the interchange format at every moment: what a process that was killed leaves is read by
# `labctl import FOLDER`. Its folder is locked while it is in use.


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
            head_file = self.folder / f".{HEAD}"
            head_file.write_bytes(head_of(info))
            head_file.replace(self.folder / HEAD)

    def _open(self, info: RecordingInfo, block: Block) -> None:
        self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        self._handle = lock(self.folder)
        self._info, self._names = info, tuple(block.columns)
        (self.folder / HEAD).write_bytes(head_of(info))
        self._file = (self.folder / SAMPLES).open("wb")
        self._file.write((",".join(["dataset", *self._names]) + "\n").encode())


#: Readings are taken, and what is shown changes, this often, s.
BLOCK_S = 0.25
Show = Callable[[LiveState], None]


@dataclass(frozen=True)
class Ending:
    """How a live calibration ended."""

    reason: Reason
    text: str  #: why, in words
    state: LiveState  #: by a fit to all readings


def run_live(
    source: LiveSource, target: Target, spool: Spool, assessor: Assessor, show: Show, say: Callable[[str], None]
) -> Ending:
    """Calibrate while the unit is turned; every reading is on the disk before it is assessed.

    `say` is called with the first line of the stream that cannot be read. Raises LabctlError, InstrumentError or
    KeyboardInterrupt where no reading was taken; later a failure, the end of the stream and an interrupt end the
    calibration, and what was read is assessed.
    """
    reason: Reason = "stream"
    try:
        calibration = LiveCalibration(source.start(), target)
        _run(source, calibration, spool, assessor, show, say)
        reason, text = "complete", "the target is reached"
    except StreamEnded as error:
        if not spool.readings:
            raise BadInput(str(error)) from error
        reason, text = error.reason, str(error)
    except (BadInput, InstrumentError, OSError) as error:
        if not spool.readings:
            raise
        text = str(error)
    except KeyboardInterrupt:
        if not spool.readings:
            raise
        reason, text = "interrupted", "the person at the terminal ended it"
    finally:
        source.stop()
        spool.close()
    last = assessor.last(calibration)
    show(last)
    return Ending(reason, text, last)


def _run(
    source: LiveSource, calibration: LiveCalibration, spool: Spool, assessor: Assessor, show: Show,
    say: Callable[[str], None],
) -> None:  # fmt: skip
    """Run until the target is reached; raises StreamEnded, and what stream, disk and person raise."""
    damaged = False
    while True:
        block = source.read(BLOCK_S)
        if block.example and not damaged:
            damaged = True
            say(f"a line of the stream is left out: {block.example}")
        _take(calibration, spool, block)
        if not len(calibration) or (state := assessor.state(calibration)) is None:
            continue
        show(state)
        source.ask(state.request)
        # the state may be older than the readings: what counts is the fit to all of them, as they are stored
        if state.done and assessor.last(calibration).done:
            return


def _take(calibration: LiveCalibration, spool: Spool, block: Block) -> None:
    spool.add(calibration.info, block)
    if len(block):
        calibration.add(block.columns, lost=block.lost, damaged=block.damaged)
    else:
        calibration.add_unread(lost=block.lost, damaged=block.damaged)


#: Says one sentence to the person at the terminal.
Say = Callable[[str], None]


def calibrate_live(
    commands: CommandExecutor, source: LiveSource, target: Target, assessor: Assessor, folder: Path, *,
    keep_folder: bool, show: Show, say: Say, attended: AbstractContextManager[None],
    fits_anyway: Callable[[], bool] = lambda: False,
) -> LiveResponse:  # fmt: skip
    """Calibrate by a stream, then have `commands` import its recording and, where the target is reached, fit it.

    `folder` holds the readings meanwhile; it is removed once they are in the database, unless it is to be kept.
    `attended` is entered for the time of the stream: what a signal does then. `fits_anyway` says at its end whether a
    version is also fitted where the target is not reached. Raises LabctlError, InstrumentError; where readings were
    taken, `say` has said where they are.
    """
    with Spool(folder) as spool:  # in use until its readings are in the database, and it is removed
        try:
            with attended:
                ending = run_live(source, target, spool, assessor, show, say)
            imported = commands.execute(IMPORT_RECORDING, RecordingFolder(folder))
        except BaseException:
            if spool.readings:
                say(f"the {spool.readings} readings so far are kept; import them with `labctl import {folder}`")
            raise
        finally:
            assessor.close()
        if not keep_folder:
            shutil.rmtree(folder, ignore_errors=True)
    fitted: FitResponse | None = None
    refused = ""
    if ending.state.done or fits_anyway():
        request = FitRequest(recordings=[imported.recording], model=POSES, effects=[])
        try:
            fitted = commands.execute(FIT, ToUnit(imported.serial, request))
        except LabctlError as error:
            refused = str(error)
    return _answer(imported.serial, ending, imported.recording, fitted, refused)


def _answer(serial: str, ending: Ending, recording: int, fitted: FitResponse | None, refused: str) -> LiveResponse:
    return LiveResponse(
        **figures_of(ending.state),
        serial=serial,
        complete=ending.state.done,
        ended=ending.reason,
        text=ending.text,
        recording=recording,
        fit=fitted,
        refused=refused,
    )
