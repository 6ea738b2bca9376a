"""A journal in memory."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from instruments.interfaces.gyro import Readings


class RecordingJournal:
    """Keeps everything in the order in which it was handed over; `hooks` are called with every entry's name."""

    def __init__(self, trace: list[str]) -> None:
        self.trace = trace
        self.states: list[tuple[str, str]] = []
        self.steps: list[tuple[str, int, Any]] = []
        self.headers: list[Any] = []
        self.closed: list[tuple[int, str, str]] = []
        self.withdrawn: list[tuple[int, str, str]] = []
        self.angles: list[tuple[int, Any]] = []
        self.timed_runs: list[Any] = []
        self.clock_u: list[tuple[float, int]] = []
        self.blocks: list[tuple[int, str, Readings, float]] = []
        self.samples: list[Any] = []
        self.events: list[Any] = []
        self.sessions: list[int] = []
        self.dropped: list[tuple[str, str]] = []
        self.hooks: list[Callable[[str, Any], None]] = []

    def _reported(self, what: str, detail: Any) -> None:
        self.trace.append(f"journal.{what}")
        for hook in list(self.hooks):
            hook(what, detail)

    def campaign_state(self, state: Any, reason: str, t_s: float, at: Any) -> None:
        assert at.tzinfo is not None
        self.states.append((str(state), reason))
        self._reported("state", state)

    def step_started(self, index: int, t_s: float, at: Any) -> None:
        self.steps.append(("started", index, t_s))
        self._reported("step_started", index)

    def step_ended(self, index: int, result: Any, t_s: float, at: Any) -> None:
        self.steps.append(("ended", index, result))
        self._reported("step_ended", index)

    def session_began(self, run: int, t_s: float) -> None:
        self.sessions.append(run)
        self._reported("session_began", run)

    def unit_dropped(self, gyro: str, reason: str) -> None:
        self.dropped.append((gyro, reason))
        self._reported("unit_dropped", gyro)

    def dataset_opened(self, header: Any) -> int:
        self.headers.append(header)
        self._reported("dataset_opened", header)
        return len(self.headers)

    def readings(self, dataset: int, gyro: str, readings: Readings, chamber_c: float) -> None:
        self.blocks.append((dataset, gyro, readings, chamber_c))
        self._reported("readings", dataset)

    def table_angles(self, dataset: int, angles: Any) -> None:
        self.angles.append((dataset, angles))
        self._reported("table_angles", dataset)

    def timed_run(self, run: Any) -> None:
        self.timed_runs.append(run)
        self._reported("timed_run", run)

    def step_clock(self, u_ppm: float, freedom: int, factor: Callable[[float], float]) -> None:
        self.clock_u.append((u_ppm, freedom))
        self._reported("step_clock", u_ppm)

    def dataset_closed(self, dataset: int, state: Any, reason: str = "") -> None:
        self.closed.append((dataset, str(state), reason))
        self._reported("dataset_closed", dataset)

    def dataset_withdrawn(self, dataset: int, gyro: str, reason: str) -> None:
        self.withdrawn.append((dataset, gyro, reason))
        self._reported("dataset_withdrawn", dataset)

    def environment(self, sample: Any) -> None:
        self.samples.append(sample)
        self._reported("environment", sample)

    def event(self, event: Any, t_s: float, at: Any) -> None:
        self.events.append(event)
        self._reported("event", event)

    def kinds(self) -> list[str]:
        return [event.kind for event in self.events]

    def results(self) -> list[Any]:
        return [detail for what, _, detail in self.steps if what == "ended"]
