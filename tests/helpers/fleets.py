"""Fleets of single-axis units, whose recordings are means made by a plain formula."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from datetime import UTC, datetime, timedelta

import numpy as np

from instruments.clock import VirtualClock
from labctl.answers.fleet import FleetJobRequest, FleetJobResponse
from labctl.recording import Recording, RecordingInfo
from labctl.services.fleet.foreground import run_with
from labctl.services.fleet.task import FleetTask, Outcome, perform
from labctl.store import Store

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
RATES_DPS, TEMPERATURES_C = np.linspace(-60.0, 60.0, 7), (0.0, 20.0, 40.0)
WHITE_DPS, READINGS = 0.02, 400


def unit_points(number: int, model: str = "FOG-A", *, scale: float = 0.0, cubic: float = 0.0) -> Recording:
    """Return the means of unit `number`: bias and scale factor of its own, `cubic` of its error at the full rate."""
    draw = np.random.default_rng([11, number])
    rates = np.tile(RATES_DPS, len(TEMPERATURES_C))
    warm = np.repeat(TEMPERATURES_C, len(RATES_DPS))
    n = len(rates)
    out = rates * (1 + scale + 1e-3 * draw.normal()) + 0.02 * draw.normal() + cubic * (rates / 60.0) ** 3
    columns = {
        "dataset": np.arange(1, n + 1), "t_s": np.arange(n) * 75.0, "run": np.ones(n, dtype=np.int64),
        "position": np.full(n, "x"), "table_rate_dps": rates, "temperature_c": warm, "n": np.full(n, READINGS),
        "gyro_x": out + draw.normal(0, WHITE_DPS / np.sqrt(READINGS), n), "gyro_x_std": np.full(n, WHITE_DPS),
    }  # fmt: skip
    began = AT + timedelta(days=number)
    info = RecordingInfo(serial=f"U{number:05d}", model=model, axes=("x",), kind="points", started_at=began)
    return Recording(info, columns)


def add_units(store: Store, count: int, first: int = 0) -> None:
    """Import the recordings of so many units."""
    for number in range(first, first + count):
        store.recordings.add_import(unit_points(number), AT)


class Done:
    """A task that was done when it was begun."""

    def __init__(self, future: Future[Outcome]) -> None:
        self.future = future

    def leave(self) -> None:
        """Nothing is under way."""


class HereEngine:
    """Does each task in this thread; `before` may raise what an engine's worker raises, CancelledError to be lost."""

    def __init__(self, store: Store, before: Callable[[FleetTask], None] = lambda _: None, at_once: int = 1) -> None:
        self._store, self._before, self.at_once = store, before, at_once
        self.reconnected = 0

    def submit(self, task: FleetTask) -> Done:
        """Do a task."""
        future: Future[Outcome] = Future()
        try:
            self._before(task)
            future.set_result(perform(self._store, task))
        except CancelledError:
            future.cancel()
            future.set_running_or_notify_cancel()
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                raise
            future.set_exception(error)
        return Done(future)

    def reconnect(self) -> None:
        """Count the call."""
        self.reconnected += 1

    def close(self) -> None:
        """Release nothing."""


def run_job(
    store: Store,
    engine: HereEngine | None = None,
    told: Callable[[FleetJobResponse], None] = lambda _: None,
    **asked: object,
) -> FleetJobResponse:
    """Carry out a job of all units, by default a fit of bias and scale factor."""
    fields = {"kind": "fit", "effects": ["bias", "scale_factor"]} if "kind" not in asked else {}
    request = FleetJobRequest.model_validate({**fields, **asked})
    return run_with(store, VirtualClock(AT), request, lambda: engine or HereEngine(store), told)
