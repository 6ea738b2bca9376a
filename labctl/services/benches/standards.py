"""Reference standards of a bench: those that its file states, and those that its instruments' settings say."""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import date

from instruments.bench_config import BenchFile
from instruments.standards import MEASURED_STEP_CLOCK, Standard
from instruments.transport.latency import USUAL_S
from procedures.contracts.journal import Event
from procedures.planning.clock_runs import FIRST_RUNS

#: Names of what settings of the bench file say; a standard of the same quantity in `[[standards]]` replaces the first.
CLOCK_SETTING = "clock_u_ppm of [table]"
DEMANDED_RATE = "rate_u_ppm of [table]"


def standards_of(bench: BenchFile) -> tuple[Standard, ...]:
    """Return the reference standards of a bench whose sections are by the models of their drivers."""
    stated = {standard.quantity for standard in bench.standards}
    derived = [each for each in _of_table(bench) if each.name == MEASURED_STEP_CLOCK or each.quantity not in stated]
    if "thermometer" not in stated:
        derived += _of_references(bench)
    return (*bench.standards, *derived)


def _of_table(bench: BenchFile) -> list[Standard]:
    """Return what the settings of the table say of its rate, ppm."""
    clock_u_ppm, clock_run_s = _setting(bench, "clock_u_ppm"), _setting(bench, "clock_run_s")
    rate_u_ppm = _setting(bench, "rate_u_ppm")
    if clock_run_s:  # then the computer's clock is the time base
        u_ppm, freedom = _expected_of_runs(_setting(bench, "reply_u_s"), clock_run_s)
        return [Standard(quantity="table_rate", unit="ppm", name=MEASURED_STEP_CLOCK, u=u_ppm, freedom=freedom)]
    if clock_u_ppm is not None:
        return [Standard(quantity="clock", name=CLOCK_SETTING, u=clock_u_ppm)]
    if rate_u_ppm is not None and getattr(bench.table, "reference", "") == "demanded":
        return [Standard(quantity="table_rate", unit="ppm", name=DEMANDED_RATE, u=rate_u_ppm)]
    return []


def _expected_of_runs(reply_u_s: float | None, clock_run_s: float) -> tuple[float, float]:
    """Return what the runs before the first data set will make of the step clock: u, ppm, and degrees of freedom.

    What a campaign measures takes its place in the recordings. Half of the runs are longer by `clock_run_s`, and
    two replies time each of them.
    """
    reply_u_s = reply_u_s or USUAL_S / math.sqrt(12.0)
    u_s = math.sqrt(2.0) * reply_u_s * math.sqrt(4.0 / FIRST_RUNS)
    return 1e6 * u_s / clock_run_s, float(FIRST_RUNS - 2)


def _of_references(bench: BenchFile) -> list[Standard]:
    """Return the reference thermometer by which the units are fitted, where its uncertainty is stated."""
    return [
        Standard(quantity="thermometer", name=reference.name, u=reference.u_c, certificate=reference.certificate)
        for reference in bench.references
        if reference.is_temperature and reference.u_c is not None
    ]


def _setting(bench: BenchFile, name: str) -> float | None:
    value = getattr(bench.table, name, None)
    return float(value) if isinstance(value, int | float) else None


def overdue_events(standards: Sequence[Standard], on: date) -> tuple[Event, ...]:
    """Return a warning for each standard whose due date is before a day."""
    return tuple(
        Event(
            "standard_overdue",
            f"standard {standard.label} was due on {standard.due}, {(on - standard.due).days} days ago; have it "
            "calibrated: a "
            "certificate of what is measured now is refused",
            level="warning",
            device=standard.quantity,
            value=float((on - standard.due).days),
            limit=0.0,
            unit="d",
        )
        for standard in standards
        if standard.due is not None and standard.is_overdue(on)
    )
