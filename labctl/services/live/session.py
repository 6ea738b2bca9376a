"""The loop of a live calibration: read, write down, assess, show; until it is complete or the stream ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from instruments.errors import InstrumentError
from labctl.errors import BadInput
from labctl.fitting.live import LiveCalibration, LiveState, Target
from labctl.services.live.assessor import Assessor
from labctl.services.live.source import Block, LiveSource, Reason, StreamEnded
from labctl.services.live.spool import Spool

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
