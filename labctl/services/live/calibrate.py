"""A live calibration from its stream to the database: a recording in any case, and a version when it is complete."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

from labctl.errors import LabctlError
from labctl.fitting.live import Target
from labctl.fitting.models.presets import POSES
from labctl.services.commands.command import CommandExecutor
from labctl.services.commands.registry import FIT, IMPORT_RECORDING
from labctl.services.commands.requests import RecordingFolder, ToUnit
from labctl.services.live.assessor import Assessor
from labctl.services.live.figures import figures_of
from labctl.services.live.session import Ending, Show, run_live
from labctl.services.live.source import LiveSource
from labctl.services.live.spool import Spool
from labctl.services.schemas.calibrations import FitRequest, FitResponse
from labctl.services.schemas.live import LiveResponse

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
