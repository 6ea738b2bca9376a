"""Fleet jobs and the report on a type as text."""

from __future__ import annotations

from types import TracebackType
from typing import TYPE_CHECKING, Self

from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from labctl.cli.output import console, format_number, stderr, table
from labctl.fitting.numeric.rounding import rounded_to_uncertainty
from labctl.shown_unit import shown_unit
from labctl.texts import counted

if TYPE_CHECKING:
    from labctl.answers.fleet import (
        FleetJobResponse,
        FleetPublishResponse,
        FleetReportResponse,
        FleetTypeResponse,
        FleetUnitResponse,
    )

#: Outliers that are printed; --json has more.
MAX_OUTLIERS = 20
#: Units that could not be published that are printed; --json has more.
MAX_UNPUBLISHED = 20


class FleetProgress:
    """One line on standard error: units that are finished, of how many, and the time left."""

    def __init__(self, *, quiet: bool) -> None:
        """`quiet`: show nothing; nor is anything shown where standard error is no terminal."""
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=28),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            console=stderr,
            disable=quiet or not stderr.is_terminal,
            transient=True,
        )
        self._task = self._progress.add_task("starting", total=1.0)

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._progress.stop()

    def update(self, answer: FleetJobResponse) -> None:
        """Show how far a job is."""
        finished = answer.units - answer.waiting
        left = "" if answer.left_s is None else f", {_time(answer.left_s)} left"
        text = f"fleet job {answer.id}: {finished} of {answer.units} units{left}"
        self._progress.update(self._task, description=text, total=answer.units, completed=finished)


def _time(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


def print_job(answer: FleetJobResponse) -> None:
    """Print how a job stands, and what it has cost."""
    counts = [f"{answer.done} done", f"{answer.skipped} skipped", f"{answer.failed} failed"]
    if answer.waiting:
        counts.append(f"{answer.waiting} left")
    console.print(f"fleet job {answer.id} ({answer.kind}, {answer.engine}): {answer.state}", style="bold")
    console.print(f"  {counted(answer.units, 'unit')}: {', '.join(counts)}")
    if answer.processor_s_per_unit is not None:
        console.print(
            f"  processor time {answer.processor_s:.1f} s, {answer.processor_s_per_unit:.3g} s per unit computed"
        )
    if answer.skipped:
        console.print("  skipped: newest result by the same recordings, model and program; --again computes them too")
    if answer.why:
        console.print(f"  {answer.why}", soft_wrap=True)


def print_jobs(answers: list[FleetJobResponse]) -> None:
    """Print jobs as a table."""
    if not answers:
        console.print("no fleet job yet; `labctl fleet fit --model NAME` starts one")
        return
    rows = table("", "job", "kind", "state", "engine", "units", "done", "skipped", "failed", "s per unit", numbers=5)
    for each in answers:
        rows.add_row(
            str(each.id), each.kind, each.state, each.engine, str(each.units), str(each.done), str(each.skipped),
            str(each.failed), format_number(each.processor_s_per_unit, 3),
        )  # fmt: skip
    console.print(rows)


def print_units(answers: list[FleetUnitResponse], total: int, more: str) -> None:
    """Print what came of units; `more` says how to see those that are left out here."""
    if not answers:
        console.print("no unit of the job is in this state")
        return
    rows = table("", "unit", "state", "version", "verdict", "reason")
    for each in answers:
        version = "–" if each.version is None else str(each.version)
        rows.add_row(each.serial, each.state, version, each.verdict or "–", each.reason)
    console.print(rows)
    if len(answers) < total:
        console.print(f"{len(answers)} of {total} units; {more}")


def print_published(answer: FleetPublishResponse) -> None:
    """Print what was written to a storage."""
    console.print(f"{answer.url}: recordings of {counted(answer.units, 'unit')}", style="bold", soft_wrap=True)
    console.print(
        f"  {counted(answer.written, 'recording')} written ({answer.size_bytes / 1e6:.3g} MB), "
        f"{answer.unchanged} unchanged"
    )
    for each in answer.failed[:MAX_UNPUBLISHED]:
        console.print(f"  {each.serial}: {each.reason}", soft_wrap=True)
    if len(answer.failed) > MAX_UNPUBLISHED:
        console.print(f"  {len(answer.failed) - MAX_UNPUBLISHED} more could not be published; --json lists all")


def print_report(answer: FleetReportResponse) -> None:
    """Print the report on a type."""
    _print_figures(answer.figures)
    if answer.coefficients:
        rows = table("", "coefficient", "unit", "mean", "U", "spread", "u of a unit", numbers=4)
        for each in answer.coefficients:
            shown = shown_unit(each.unit, each.name)
            mean = rounded_to_uncertainty(shown.factor * each.mean, shown.factor * each.expanded_u_mean)
            rows.add_row(
                each.name, shown.unit, mean.value + mean.power, mean.u + mean.power if mean.u else "–",
                shown.number(each.spread, 3), shown.number(each.median_u),
            )  # fmt: skip
        console.print(rows)
    for outlier in answer.outliers[:MAX_OUTLIERS]:
        console.print(f"{outlier.serial}: {outlier.text}", soft_wrap=True)
    for sentence in answer.text:
        console.print(sentence, style="bold", soft_wrap=True)


def _print_figures(figures: FleetTypeResponse) -> None:
    console.print(f"type {figures.type or 'not stated'}: {counted(figures.units, 'unit')}", style="bold")
    classes = [
        f"{each.units} {f'below {each.high:g}' if each.high is not None else f'from {each.low:g}'}"
        for each in figures.error_over_floor
        if each.units
    ]
    console.print(f"  error over noise floor: {', '.join(classes) or 'no fleet job has fitted any'}", soft_wrap=True)
    verdicts = [f"{units} {verdict}" for verdict, units in figures.verdicts.items()]
    console.print(f"  verdicts: {', '.join(verdicts) or 'no fleet job has criticised any'}", soft_wrap=True)
    if figures.missing:
        named = [f"{effect} in {units}" for effect, units in figures.missing.items()]
        console.print(f"  named as missing: {', '.join(named)}", soft_wrap=True)
    due = figures.due
    console.print(
        f"  due: {due.overdue} overdue, {due.within_30_days} within 30 days, {due.within_90_days} within 90 days, "
        f"{due.later} later, {due.no_date} without a date; {due.none_in_force} without a version in force"
    )
