"""When the readings so far are assessed: beside the stream, which goes on meanwhile, or at once."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from typing import Protocol

from labctl.fitting.live import LiveCalibration, LiveState


class Assessor(Protocol):
    """Gives states of a live calibration."""

    def state(self, calibration: LiveCalibration) -> LiveState | None:
        """Return a new state where there is one; does not wait."""
        ...

    def last(self, calibration: LiveCalibration) -> LiveState:
        """Return the state by a fit to all readings, after the assessment that runs."""
        ...

    def close(self) -> None:
        """Wait for the assessment that runs. Safe to call twice."""
        ...


class InlineAssessor:
    """Assesses in the thread of the stream: for a simulation, whose stream waits."""

    def state(self, calibration: LiveCalibration) -> LiveState | None:
        return calibration.assess()

    def last(self, calibration: LiveCalibration) -> LiveState:
        return calibration.assess(finally_=True)

    def close(self) -> None:
        return


class BackgroundAssessor:
    """Assesses in a thread of its own, one assessment after the other."""

    def __init__(self) -> None:
        self._executor = ThreadPoolExecutor(1, "live-assessment")
        self._running: Future[LiveState] | None = None

    def state(self, calibration: LiveCalibration) -> LiveState | None:
        live_state = None
        if self._running is not None:
            if not self._running.done():
                return None
            live_state = self._running.result()
        self._running = self._executor.submit(calibration.assess)
        return live_state

    def last(self, calibration: LiveCalibration) -> LiveState:
        if self._running is not None:
            self._running.result()
            self._running = None
        return calibration.assess(finally_=True)

    def close(self) -> None:
        self._executor.shutdown(wait=True)
