"""Stopping a bench through its drivers, with no process left that could do it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass

from instruments.bench import open_bench
from instruments.bench_config import BenchFile
from instruments.shared_clock import clock_outside
from procedures.execution.safe_state import TABLE, make_safe

#: Before the second try of what could not be confirmed, s: a port that a process had open is free a moment later.
PAUSES_S = (0.5,)


@dataclass(frozen=True)
class InstrumentsLeft:
    """How the instruments of a bench were left."""

    stands: bool  #: whether the table is confirmed to stand
    safe: bool  #: whether all of the safe state is confirmed
    text: str


def stop_instruments(
    document: Mapping[str, object],
    say: Callable[[str], None] = lambda _: None,
    stands: Callable[[], None] = lambda: None,
) -> InstrumentsLeft:
    """Bring table, chamber and supply of a bench to their safe state. Raises nothing.

    `document` is the bench file as JSON; `say` gets what could not be confirmed yet, `stands` is called as soon as the
    table is at rest.
    """
    try:
        bench_file = BenchFile.model_validate(document)
        return _stopped(bench_file.model_copy(update={"gyros": (), "references": ()}), say, stands)
    except Exception as error:  # noqa: BLE001  whatever it is, the answer is that the bench is not known to stand
        return InstrumentsLeft(stands=False, safe=False, text=f"the instruments cannot be reached: {error}")


def _stopped(bench: BenchFile, say: Callable[[str], None], stands: Callable[[], None]) -> InstrumentsLeft:
    at_rest = False

    def note(text: str, complaint: str) -> None:
        nonlocal at_rest
        if complaint:
            say(f"{text}: {complaint}")
        elif text == TABLE:
            at_rest = True
            stands()

    clock = clock_outside(bench)
    with closing(open_bench(bench, clock)) as opened:
        complaints = make_safe(opened, clock, PAUSES_S, note)
    if complaints:
        return InstrumentsLeft(at_rest, safe=False, text="; ".join(complaints))
    sections = (
        ("table at rest", bench.table), ("chamber at its safe set point", bench.chamber),
        ("supply in its safe state", bench.supply),
    )  # fmt: skip
    parts = ", ".join(name for name, section in sections if section is not None)
    return InstrumentsLeft(at_rest, safe=True, text=parts or "nothing on this bench moves by itself")
