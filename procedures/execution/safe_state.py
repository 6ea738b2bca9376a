"""The safe state: table at rest, chamber and supply at their safe set points and read back, streams closed."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from functools import partial

from instruments.clock import Clock
from instruments.interfaces.chamber import Chamber
from instruments.interfaces.supply import Supply
from instruments.interfaces.table import RateTable
from procedures.contracts.bench import Bench

STANDSTILL_TIMEOUT_S = 30.0
#: Before each further round of what could not be confirmed: a link may come back.
PAUSES_S = (2.0, 10.0, 30.0)
#: The first part of the safe state.
TABLE = "table to rest"

#: Called for each part that was tried: which, and what could not be confirmed, empty when it is confirmed.
Note = Callable[[str, str], None]


def _no_note(_what: str, _complaint: str) -> None:
    pass


def make_safe(
    bench: Bench, clock: Clock, pauses_s: Sequence[float] = PAUSES_S, note: Note = _no_note
) -> tuple[str, ...]:
    """Bring the bench to its safe state; returns what could not be confirmed, empty when all is well.

    Every part is tried even when another fails; what failed is tried again after each of the pauses, after all the
    others. An interrupt (Ctrl-C) during a part makes it be tried once more. `note` is called for each part; it may
    neither block nor raise.
    """
    if bench.table is None:
        note(TABLE, "")
    open_parts = [(what, part, "") for what, part in _parts(bench, clock)]
    for pause_s in (0.0, *pauses_s):
        with contextlib.suppress(KeyboardInterrupt):  # without the pause the next try only comes earlier
            clock.sleep(pause_s)
        tried = []
        for what, part, _ in open_parts:
            complaint = _tried(what, part)
            note(what, complaint.removeprefix(f"{what}: "))
            tried.append((what, part, complaint))
        open_parts = [each for each in tried if each[2]]
        if not open_parts:
            break
    return tuple(complaint for _, _, complaint in open_parts)


def _parts(bench: Bench, clock: Clock) -> Iterator[tuple[str, Callable[[], str | None]]]:
    if bench.table is not None:
        yield TABLE, partial(stop_table, bench.table, clock)
    if bench.chamber is not None:
        yield "chamber to its safe set point", partial(_make_chamber_safe, bench.chamber)
    if bench.supply is not None:
        what = "supply switched off" if bench.supply.safe_state == "off" else "supply to its nominal voltage"
        yield what, partial(_make_supply_safe, bench.supply)
    for name, gyro in bench.gyros.items():
        yield f"stream of {name} closed", gyro.stop


def _tried(what: str, part: Callable[[], str | None]) -> str:
    """Try one part, once more after an interrupt; returns what is to be complained of, empty when it is confirmed."""
    try:
        try:
            complaint = part()
        except KeyboardInterrupt:
            complaint = part()
    except KeyboardInterrupt:
        return f"{what}: interrupted twice"
    except Exception as error:  # noqa: BLE001  whatever one part does, the others are still tried
        return f"{what}: {str(error) or type(error).__name__}"
    return f"{what}: {complaint}" if complaint else ""


def stop_table(table: RateTable, clock: Clock) -> str | None:
    """Stop the table and poll it until it is at rest; returns what could not be confirmed. Raises InstrumentError."""
    table.stop()
    until_s = clock.now_s() + STANDSTILL_TIMEOUT_S
    while table.is_moving():
        if clock.now_s() >= until_s:
            return (
                f"the table still moves {STANDSTILL_TIMEOUT_S:g} s after it was stopped; switch the power of "
                "the table off"
            )
        clock.sleep(1.0)
    return None


def _make_chamber_safe(chamber: Chamber) -> str | None:
    set_c = chamber.make_safe()
    if abs(set_c - chamber.safe_c) > chamber.limits.resolution_c:
        return (
            f"set point {set_c:g} deg C was read back instead of {chamber.safe_c:g} deg C; set it at the "
            "panel of the chamber"
        )
    return None


def _make_supply_safe(supply: Supply) -> str | None:
    set_v = supply.make_safe()
    wanted_v = 0.0 if supply.safe_state == "off" else supply.limits.nominal_v
    if abs(set_v - wanted_v) > supply.limits.tolerance_v:
        return f"{set_v:g} V was read back instead of {wanted_v:g} V; set it at the panel of the supply"
    return None
