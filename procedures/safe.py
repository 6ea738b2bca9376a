"""The safe state: table at rest, chamber at its safe set point and read back, streams closed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

from instruments.chamber import Chamber
from instruments.clock import Clock
from instruments.table import RateTable
from procedures.bench import Bench

STANDSTILL_TIMEOUT_S = 30.0


def make_safe(bench: Bench, clock: Clock) -> tuple[str, ...]:
    """Bring the bench to its safe state; returns what could not be confirmed, empty when all is well.

    Every part is tried even when another fails. An interrupt (Ctrl-C) during a part makes it be tried once more.
    """
    return tuple(complaint for part in _parts(bench, clock) for complaint in _tried(*part))


def _parts(bench: Bench, clock: Clock) -> Iterator[tuple[str, Callable[[], str | None]]]:
    yield "table to rest", partial(stop_table, bench.table, clock)
    yield "chamber to its safe set point", partial(_make_chamber_safe, bench.chamber)
    for name, gyro in bench.gyros.items():
        yield f"stream of {name} closed", gyro.stop


def _tried(what: str, part: Callable[[], str | None]) -> list[str]:
    for attempt in (1, 2):
        try:
            complaint = part()
        except Exception as error:  # noqa: BLE001  whatever one part does, the others are still tried
            return [f"{what}: {error or type(error).__name__}"]
        except KeyboardInterrupt:
            if attempt == 2:
                return [f"{what}: interrupted twice"]
        else:
            return [f"{what}: {complaint}"] if complaint else []
    return []


def stop_table(table: RateTable, clock: Clock) -> str | None:
    """Bring the table to rest and look until it stands; returns what could not be confirmed. Raises InstrumentError."""
    table.stop()
    until_s = clock.now_s() + STANDSTILL_TIMEOUT_S
    while table.is_moving():
        if clock.now_s() >= until_s:
            return f"it still moves {STANDSTILL_TIMEOUT_S:g} s after it was stopped; switch its power off"
        clock.sleep(1.0)
    return None


def _make_chamber_safe(chamber: Chamber) -> str | None:
    set_c = chamber.make_safe()
    if abs(set_c - chamber.safe_c) > chamber.limits.resolution_c:
        return f"set point {set_c:g} deg C was read back instead of {chamber.safe_c:g} deg C; set it by hand"
    return None
