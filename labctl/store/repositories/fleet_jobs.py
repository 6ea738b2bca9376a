"""Fleet jobs: which units, how far they are, and what came of each; every result is written once."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Literal

import sqlalchemy as sa
from sqlalchemy import exc

from labctl.answers.fleet import FleetJobState, FleetKind, FleetUnitState
from labctl.answers.json_object import JsonObject
from labctl.errors import Conflict, NotFound, VersionTaken
from labctl.natural_order import natural_key
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.paging import Page, PageRequest, rows_to_read
from labctl.store.repositories.audit import append
from labctl.store.repositories.calibrations import NewCalibration, add_version
from labctl.store.repositories.fleet_filter import FleetFilter
from labctl.store.repositories.records_by_name import record_of, records_of
from labctl.store.schema import tables

#: States in which something is left to do.
OPEN: tuple[FleetJobState, ...] = ("waiting", "running")


@dataclass(frozen=True)
class NewFleetJob:
    """A job that is asked for."""

    kind: FleetKind
    request: JsonObject
    engine: str
    by: str


@dataclass(frozen=True)
class FleetJobRow(NewFleetJob):
    """A job as it is kept."""

    id: int
    created_at: datetime
    units: int
    state: FleetJobState
    runner: str  #: process that carries it out; empty: none yet
    seen_at: datetime | None  #: last sign of life of that process
    started_at: datetime | None
    ended_at: datetime | None
    cancel_asked: bool
    why: str


@dataclass(frozen=True)
class FleetCounts:
    """How far a job is: its units by state, and the processor time of those that were computed, s."""

    waiting: int = 0
    done: int = 0
    failed: int = 0
    skipped: int = 0
    processor_s: float = 0.0


@dataclass(frozen=True)
class FleetCoefficient:
    """A coefficient of a version that a job made."""

    axis: str
    name: str
    value: float
    u: float | None
    unit: str


@dataclass(frozen=True)
class FleetResult:
    """What came of one unit. `state` is done, failed or skipped."""

    serial: str
    state: Literal["done", "failed", "skipped"]
    question: str = ""  #: digest of all that the result depends on
    version: int | None = None
    reason: str = ""
    processor_s: float | None = None
    rms_dps: float | None = None
    noise_floor_dps: float | None = None
    verdict: str | None = None
    named: list[str] | None = None


@dataclass(frozen=True)
class FleetFit:
    """A version that a job made, with what is kept of it for the report."""

    version: int
    new: NewCalibration
    model: str
    measured_at: datetime | None
    bench: str
    coefficients: list[FleetCoefficient] = field(default_factory=list)


@dataclass(frozen=True)
class FleetUnitRow(FleetResult):
    """A unit of a job as it is kept."""

    state: FleetUnitState  # type: ignore[assignment]
    at: datetime | None = None


@dataclass(frozen=True)
class FleetEvidence:
    """What the criticisms of some units of a type show of every effect, added up."""

    type: str  #: model of the units
    model: str  #: error model of their versions
    serials: list[str]
    content: bytes


class FleetJobs:
    """Jobs over many units."""

    def __init__(self, database: Database) -> None:
        self._database = database

    @transaction
    def begin(self, new: NewFleetJob, wanted: FleetFilter, runner: str, at: datetime) -> int:
        """Write down a job with its units; returns its number. Raises NotFound where no unit matches.

        `runner` is the process that carries it out at once; empty: the next service.
        """
        j, u = tables.fleet_jobs, tables.units
        with self._database.writing() as connection:
            values: dict[str, Any] = {
                "kind": new.kind,
                "request": dict(new.request),
                "engine": new.engine,
                "by": new.by,
            }
            number = connection.scalar(
                sa.insert(j).values(**values, created_at=at, units=0, state="waiting", runner=runner, seen_at=at)
                .returning(j.c.id)
            )  # fmt: skip
            which = sa.select(
                sa.literal(number).label("job_id"), u.c.serial, sa.literal(new.kind), sa.literal("waiting")
            ).where(wanted.condition)
            columns = ["job_id", "serial", "kind", "state"]
            connection.execute(sa.insert(tables.fleet_units).from_select(columns, which, include_defaults=False))
            x = tables.fleet_units.c
            units = int(connection.scalar(sa.select(sa.func.count()).where(x.job_id == number)) or 0)
            if not units:
                raise wanted.no_match()
            connection.execute(sa.update(j).where(j.c.id == number).values(units=units))
            detail = {"request": dict(new.request), "units": units, "engine": new.engine}
            append(connection, at, f"fleet {new.kind}", _subject(int(number or 0)), detail)
        return int(number or 0)

    def get(self, job: int) -> FleetJobRow:
        """Return one job. Raises NotFound."""
        with self._database.reading() as connection:
            result = connection.execute(sa.select(tables.fleet_jobs).where(tables.fleet_jobs.c.id == job))
            row = result.mappings().first()
        if row is None:
            raise NotFound(f"fleet job {job} is not in this database; `labctl fleet jobs` lists the jobs")
        return record_of(FleetJobRow, row)

    def page(self, request: PageRequest[int]) -> Page[FleetJobRow, int]:
        """Return jobs, newest first."""
        j = tables.fleet_jobs.c
        after = sa.true() if request.after is None else j.id < request.after
        query = sa.select(tables.fleet_jobs).where(after).order_by(j.id.desc()).limit(rows_to_read(request))
        with self._database.reading() as connection:
            rows = records_of(FleetJobRow, connection.execute(query))
            total = int(connection.scalar(sa.select(sa.func.count()).select_from(tables.fleet_jobs)) or 0)
        return Page.of(rows, lambda row: row.id, request, total)

    def serials(self, wanted: FleetFilter, after: str, limit: int) -> list[str]:
        """Return the serial numbers of measured units that are wanted, in order, the first `limit` beyond `after`."""
        c = tables.units.c
        beyond = c.serial_key > natural_key(after)
        query = sa.select(c.serial).where(wanted.condition, beyond).order_by(c.serial_key).limit(limit)
        with self._database.reading() as connection:
            return [str(serial) for serial in connection.scalars(query)]

    def open(self) -> list[FleetJobRow]:
        """Return the jobs that have not ended, oldest first."""
        query = sa.select(tables.fleet_jobs).where(tables.fleet_jobs.c.state.in_(OPEN))
        with self._database.reading() as connection:
            return records_of(FleetJobRow, connection.execute(query.order_by(tables.fleet_jobs.c.id)))

    def counts(self, job: int) -> FleetCounts:
        """Return how far a job is."""
        x = tables.fleet_units.c
        query = sa.select(x.state, sa.func.count(), sa.func.sum(x.processor_s)).where(x.job_id == job)
        with self._database.reading() as connection:
            rows = list(connection.execute(query.group_by(x.state)))
        by_state = {str(state): int(n) for state, n, _ in rows}
        return FleetCounts(**by_state, processor_s=sum(float(cost or 0) for _, _, cost in rows))

    def units(
        self, job: int, request: PageRequest[str], state: FleetUnitState | None = None
    ) -> Page[FleetUnitRow, str]:
        """Return the units of a job by serial number in natural order, or those in a state."""
        x, key = tables.fleet_units.c, tables.units.c.serial_key
        columns = (
            x.serial, x.state, x.question, x.version, x.reason, x.processor_s, x.rms_dps, x.noise_floor_dps, x.verdict,
            x.named, x.at,
        )  # fmt: skip
        wanted = [x.job_id == job, request.matching((x.serial,))]
        if state is not None:
            wanted.append(x.state == state)
        total = sa.select(sa.func.count()).select_from(tables.fleet_units).where(*wanted)
        joined = tables.fleet_units.join(tables.units, tables.units.c.serial == x.serial)
        query = sa.select(*columns).select_from(joined).where(*wanted).order_by(key).limit(rows_to_read(request))
        if request.after is not None:
            query = query.where(key > natural_key(request.after))
        with self._database.reading() as connection:
            rows = records_of(FleetUnitRow, connection.execute(query))
            return Page.of(rows, lambda row: row.serial, request, int(connection.scalar(total) or 0))

    def answered(self, serial: str, kind: FleetKind) -> tuple[str, int | None] | None:
        """Return the question and the version of a unit's newest result of a kind; None where there is none.

        Nor does a criticism count that was written without its evidence, which is written for many units together.
        """
        x = tables.fleet_units.c
        has_evidence = sa.or_(x.kind != "criticise", x.evidence_id.is_not(None))
        query = sa.select(x.question, x.version).where(x.serial == serial, x.kind == kind, x.newest, has_evidence)
        with self._database.reading() as connection:
            row = connection.execute(query).first()
        return None if row is None else (row.question, row.version)

    @transaction
    def take(self, job: int, runner: str, since: datetime, at: datetime) -> bool:
        """Have a process carry out a job, unless another one gave a sign of life since an instant; returns whether.

        A sign of life that is as far in the future is from before the clock was set back.
        """
        j = tables.fleet_jobs.c
        is_free = sa.or_(j.runner.in_(("", runner)), j.seen_at < since, j.seen_at > at + (at - since))
        query = sa.update(tables.fleet_jobs).where(j.id == job, j.state.in_(OPEN), is_free)
        first = sa.func.coalesce(j.started_at, sa.bindparam("first", at, type_=tables.Instant()))
        with self._database.writing() as connection:
            taken = connection.execute(query.values(runner=runner, seen_at=at, state="running", started_at=first))
            return bool(taken.rowcount)

    @transaction
    def is_wanted(self, job: int, runner: str, at: datetime) -> bool:
        """Note that a process still carries out a job; returns False where it is to stop, or another one has it."""
        j = tables.fleet_jobs.c
        mine = sa.update(tables.fleet_jobs).where(j.id == job, j.runner == runner, j.state == "running")
        with self._database.writing(synced=False) as connection:
            return bool(connection.execute(mine.where(sa.not_(j.cancel_asked)).values(seen_at=at)).rowcount)

    @transaction
    def release(self, job: int, runner: str) -> None:
        """Leave a job to the next process that takes it."""
        j = tables.fleet_jobs.c
        own = sa.update(tables.fleet_jobs).where(j.id == job, j.runner == runner, j.state == "running")
        with self._database.writing() as connection:
            connection.execute(own.values(runner="", state="waiting"))

    @transaction
    def cancel(self, job: int, by: str, reason: str, at: datetime) -> None:
        """Ask that a job ends; what was written stays. Raises Conflict for one that has ended."""
        row = self.get(job)
        if row.state not in OPEN:
            raise Conflict(f"fleet job {job} has ended ({row.state}); start it again to do what is left")
        j = tables.fleet_jobs.c
        values: dict[str, Any] = {"cancel_asked": True, "why": f"cancelled by {by}" + (f": {reason}" if reason else "")}
        if row.state == "waiting":
            values |= {"state": "cancelled", "ended_at": at}
        with self._database.writing() as connection:
            connection.execute(sa.update(tables.fleet_jobs).where(j.id == job).values(**values))
            append(connection, at, "fleet cancel", _subject(job), {"by": by, "reason": reason})

    @transaction
    def end(self, job: int, runner: str, state: FleetJobState, why: str, at: datetime) -> None:
        """Write down the end of a job that a process carried out; nothing where another one has it."""
        j = tables.fleet_jobs.c
        query = sa.update(tables.fleet_jobs).where(j.id == job, j.runner == runner, j.state.in_(OPEN))
        values: dict[str, Any] = {"state": state, "ended_at": at} | ({"why": why} if why else {})
        with self._database.writing() as connection:
            if connection.execute(query.values(**values)).rowcount:
                append(connection, at, "fleet end", _subject(job), {"state": state, "why": why})

    @transaction
    def keep(self, job: int, kind: FleetKind, result: FleetResult, at: datetime) -> bool:
        """Write down what came of a unit; returns whether that was left to do: a second result changes nothing."""
        with self._database.writing() as connection:
            return _keep(connection, job, kind, result, at)

    @transaction
    def keep_evidence(self, job: int, new: FleetEvidence) -> None:
        """Keep sums over units whose criticisms are written."""
        e, x = tables.fleet_evidence, tables.fleet_units
        with self._database.writing() as connection:
            values = {"job_id": job, "type": new.type, "model": new.model, "content": new.content}
            number = connection.scalar(sa.insert(e).values(**values, units=len(new.serials)).returning(e.c.id))
            own = sa.update(x).where(x.c.job_id == job, x.c.serial.in_(new.serials))
            connection.execute(own.values(evidence_id=number))

    @transaction
    def keep_fit(self, job: int, result: FleetResult, fit: FleetFit, at: datetime) -> bool:
        """Keep a version and what came of its unit, both or none; False where the unit has a result already.

        Raises VersionTaken when another version got the number meanwhile; nothing was changed.
        """
        try:
            with self._database.writing() as connection:
                if not _keep(connection, job, "fit", result, at):
                    return False
                add_version(connection, result.serial, at, fit.version, fit.new)
                _replace_coefficients(connection, result.serial, fit)
        except exc.IntegrityError as error:  # where several processes write
            raise VersionTaken(
                f"{result.serial} version {fit.version} was made by another fit in the meantime; fit again"
            ) from error
        return True


def _subject(job: int) -> str:
    return f"fleet job {job}"


def _keep(connection: sa.Connection, job: int, kind: FleetKind, result: FleetResult, at: datetime) -> bool:
    x = tables.fleet_units.c
    values = {name: value for name, value in vars(result).items() if name != "serial"}
    own = sa.update(tables.fleet_units).where(x.job_id == job, x.serial == result.serial, x.state == "waiting")
    if not connection.execute(own.values(**values, at=at, newest=result.state == "done")).rowcount:
        return False
    if result.state == "done":
        earlier = sa.and_(x.serial == result.serial, x.kind == kind, x.newest, x.job_id != job)
        connection.execute(sa.update(tables.fleet_units).where(earlier).values(newest=False))
    return True


def _replace_coefficients(connection: sa.Connection, serial: str, fit: FleetFit) -> None:
    connection.execute(sa.delete(tables.fleet_coefficients).where(tables.fleet_coefficients.c.serial == serial))
    rows = [
        {
            **vars(each), "serial": serial, "model": fit.model, "version": fit.version,
            "measured_at": fit.measured_at, "bench": fit.bench,
        }
        for each in fit.coefficients
    ]  # fmt: skip
    if rows:
        connection.execute(sa.insert(tables.fleet_coefficients), rows)
