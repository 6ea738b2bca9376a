"""What is known of one live calibration of a service: how it stands, how U fell, how it ended."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime

from labctl.answers.live import (
    LiveHistoryResponse,
    LiveMoment,
    LiveResponse,
    LiveStage,
    LiveStateResponse,
    LiveUncertaintyColumn,
)
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.live import LiveCoefficient, LiveState, Target
from labctl.services.live.figures import moment_of, target_of


@dataclass(frozen=True)
class _Point:
    """One fit."""

    t_s: float
    poses: int
    coefficients: tuple[LiveCoefficient, ...]


class UncertaintyHistory:
    """U of each coefficient at every fit. One thread adds."""

    def __init__(self) -> None:
        self._fit: FitResult | None = None
        self._points: list[_Point] = []

    def __len__(self) -> int:
        return len(self._points)

    def add(self, state: LiveState) -> None:
        """Take in a state; what is no new fit adds nothing, and one to the same readings replaces the last."""
        if state.fit is None or state.fit is self._fit:
            return
        self._fit = state.fit
        if self._points and self._points[-1].t_s == state.t_s:
            self._points.pop()
        self._points.append(_Point(state.t_s, len(state.covered), state.coefficients))

    def answer(self, number: int) -> LiveHistoryResponse:
        """Return all of it, by coefficient."""
        points = list(self._points)
        columns: dict[tuple[str, str], LiveUncertaintyColumn] = {}
        for k, point in enumerate(points):
            for coefficient in point.coefficients:
                column = columns.setdefault(
                    (coefficient.axis, coefficient.name),
                    LiveUncertaintyColumn(
                        axis=coefficient.axis,
                        name=coefficient.name,
                        unit=coefficient.unit,
                        limit=coefficient.limit,
                        expanded=[None] * len(points),
                    ),
                )
                column.expanded[k] = coefficient.expanded
        return LiveHistoryResponse(
            number=number,
            t_s=[point.t_s for point in points],
            poses=[point.poses for point in points],
            coefficients=list(columns.values()),
        )


class SessionRecord:
    """One session, written by its thread and read by others."""

    def __init__(
        self, number: int, serial: str, stream: str, bench: str, by: str, started_at: datetime, target: Target,
        end_unwatched: bool, notify: Callable[[], None],
    ) -> None:  # fmt: skip
        self.number, self.serial, self.stream, self.target = number, serial, stream, target
        self.history = UncertaintyHistory()
        self.fits_anyway = False  #: whether a person wants a version although the target is not reached
        self._bench, self._by, self._started_at, self._end_unwatched = bench, by, started_at, end_unwatched
        self._notify = notify
        self._stage: LiveStage = "running"
        self._text = "waiting for the first readings"
        self._example = ""
        self._moment: LiveMoment | None = None
        self._result: LiveResponse | None = None
        self._closed, self._over = threading.Event(), threading.Event()

    @property
    def is_running(self) -> bool:
        """Whether its stream is read."""
        return not self._closed.is_set()

    @property
    def is_over(self) -> bool:
        """Whether its recording is stored, or it has failed."""
        return self._over.is_set()

    def show(self, state: LiveState) -> None:
        """Take in a state."""
        self.history.add(state)
        self._moment = moment_of(state, len(self.history), self._example)
        self._text = self._moment.request_text or "the target is reached"
        self._notify()

    def say(self, text: str) -> None:
        """Take in a remark on the stream."""
        self._example = self._example or text

    @contextmanager
    def streaming(self, closed: Callable[[], None]) -> Iterator[None]:
        """Note the time of the stream; `closed` is called at its end."""
        try:
            yield
        finally:
            self._stage, self._text = "storing", "the readings are stored, and fitted where that was reached or wanted"
            closed()
            self._closed.set()
            self._notify()

    def end(self, answer: LiveResponse) -> None:
        """Take in the answer at the end."""
        self._result = answer
        self._finish("ended" if answer.fit is None else "done", answer.text)

    def fail(self, text: str) -> None:
        """Take in why nothing was stored."""
        self._finish("failed", text)

    def _finish(self, stage: LiveStage, text: str) -> None:
        self._stage, self._text = stage, text
        self._closed.set()
        self._over.set()
        self._notify()

    def wait(self, within_s: float) -> None:
        """Wait for its end, so long at most."""
        self._over.wait(within_s)

    def wait_closed(self, within_s: float) -> None:
        """Wait until its stream is closed, so long at most."""
        self._closed.wait(within_s)

    def answer(self, kept: Sequence[str]) -> LiveStateResponse:
        """Return it as an answer."""
        return LiveStateResponse(
            stage=self._stage, number=self.number, serial=self.serial, stream=self.stream, bench=self._bench,
            by=self._by, started_at=self._started_at, end_unwatched=self._end_unwatched, target=target_of(self.target),
            moment=self._moment, text=self._text, result=self._result,
            kept=[] if self._stage in ("running", "storing") else list(kept),
        )  # fmt: skip

    @staticmethod
    def none(kept: Sequence[str]) -> LiveStateResponse:
        """Return the answer of a service that has begun none."""
        return LiveStateResponse(
            stage="idle", number=0, serial="", stream="", bench="", by="", started_at=None, end_unwatched=False,
            target=None, moment=None, text="no live calibration has run since the service began", result=None,
            kept=list(kept),
        )  # fmt: skip
