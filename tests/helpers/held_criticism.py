"""A criticism that goes on until it is cancelled."""

from __future__ import annotations

import threading

import pytest

from labctl.progress import Cancelled, report_stage
from labctl.services.criticism import evaluation

#: The stage that it reports again and again.
STAGE = "held by a test"
LONGEST_S, STEP_S = 60.0, 0.1


class HeldCriticism:
    """Takes the place of the computation of a criticism: reports a stage until it is cancelled."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.begun, self.ended = threading.Event(), threading.Event()
        self.cancelled = False
        self._never = threading.Event()
        monkeypatch.setattr(evaluation, "criticise", self)

    def __call__(self, *_: object, **__: object) -> None:
        """Report the stage until it is cancelled."""
        try:
            for _ in range(round(LONGEST_S / STEP_S)):
                report_stage(STAGE)
                self.begun.set()
                self._never.wait(STEP_S)
            raise AssertionError("was not cancelled")
        except Cancelled:
            self.cancelled = True
            raise
        finally:
            self.ended.set()
