"""Diagnoses: every move is written down before it is carried out, and each is written once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime

import sqlalchemy as sa

from labctl.answers.diagnosis import DiagnosisOutcome, DiagnosisState, ExperimentResult
from labctl.answers.json_object import JsonObject
from labctl.errors import Conflict, NotFound
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.repositories.audit import append
from labctl.store.repositories.records_by_name import record_of, records_of
from labctl.store.schema import tables

#: States in which something is to be done, by a process or a person.
OPEN: tuple[DiagnosisState, ...] = ("criticising", "awaiting_confirmation", "measuring", "stopped", "failed")
#: States in which a process goes on by itself.
MOVING: tuple[DiagnosisState, ...] = ("criticising", "measuring")


@dataclass(frozen=True)
class NewDiagnosis:
    """A diagnosis that is asked for."""

    serial: str
    version: int
    bench_name: str
    bench: JsonObject  #: bench file, as campaigns keep it
    hours: float
    recordings: Sequence[int]
    by: str
    begins_at: datetime | None  #: no experiment is begun before; None: at once


@dataclass(frozen=True)
class DiagnosisRow(NewDiagnosis):
    """A diagnosis as it is kept."""

    id: int
    created_at: datetime
    state: DiagnosisState
    outcome: str  #: a DiagnosisOutcome; empty while it is not done
    why: str
    ended_at: datetime | None


@dataclass(frozen=True)
class NewRound:
    """A criticism, and what was decided by it."""

    number: int
    recordings: Sequence[int]
    verdict: str
    named: Sequence[str]
    suspects: Mapping[str, float]
    spent_hours: float
    rms_dps: float | None
    heldout_rms_dps: float | None
    noise_floor_dps: float | None
    experiment: JsonObject | None
    why: str


@dataclass(frozen=True)
class RoundRow(NewRound):
    """A round as it is kept."""

    diagnosis: int
    at: datetime
    confirmed_by: str
    since: datetime  #: when the experiment was chosen, confirmed or asked for again
    campaign: int | None
    recording: int | None
    took_hours: float | None
    came: str  #: an ExperimentResult; empty: the experiment is not over, or there is none
    came_text: str

    @property
    def is_open(self) -> bool:
        """Whether its experiment is not over."""
        return self.experiment is not None and not self.came


class Diagnoses:
    """The diagnoses of all units."""

    def __init__(self, database: Database) -> None:
        self._database = database

    @transaction
    def begin(self, new: NewDiagnosis, at: datetime) -> int:
        """Write down a diagnosis; returns its number. Raises Conflict while another of the unit is open."""
        d = tables.diagnoses
        other = sa.select(d.c.id).where(d.c.serial == new.serial, d.c.state.in_(OPEN)).limit(1)
        with self._database.writing() as connection:
            if (number := connection.scalar(other)) is not None:
                raise Conflict(
                    f"diagnosis {number} of unit {new.serial} has not ended; let it go on, or stop it for good with "
                    f"`labctl diagnose {new.serial} --end`"
                )
            values = {**asdict(new), "bench": dict(new.bench), "recordings": list(new.recordings)}
            row = sa.insert(d).values(**values, created_at=at, state="criticising")
            number = int(connection.scalar(row.returning(d.c.id)) or 0)
            detail = {"unit": new.serial, "version": new.version, "bench": new.bench_name, "hours": new.hours}
            append(connection, at, "diagnosis start", _subject(number), detail)
        return number

    def get(self, diagnosis: int) -> DiagnosisRow:
        """Return one diagnosis. Raises NotFound."""
        rows = self._rows(tables.diagnoses.c.id == diagnosis)
        if not rows:
            raise NotFound(f"diagnosis {diagnosis} is not in this database; `labctl diagnose SERIAL` starts one")
        return rows[0]

    def of_unit(self, serial: str) -> list[DiagnosisRow]:
        """Return the diagnoses of a unit, newest first."""
        return self._rows(tables.diagnoses.c.serial == serial)

    def open_of_unit(self, serial: str) -> DiagnosisRow | None:
        """Return the diagnosis of a unit that has not ended; None for none."""
        d = tables.diagnoses.c
        return next(iter(self._rows(sa.and_(d.serial == serial, d.state.in_(OPEN)))), None)

    def moving(self, bench: str) -> list[DiagnosisRow]:
        """Return the diagnoses on a bench that go on by themselves, oldest first."""
        d = tables.diagnoses.c
        return self._rows(sa.and_(d.bench_name == bench, d.state.in_(MOVING)))[::-1]

    def rounds(self, diagnosis: int) -> list[RoundRow]:
        """Return the rounds of a diagnosis, oldest first."""
        r = tables.diagnosis_rounds.c
        query = sa.select(
            r.number, r.recordings, r.verdict, r.named, r.suspects, r.spent_hours, r.rms_dps, r.heldout_rms_dps,
            r.noise_floor_dps, r.experiment, r.why, r.diagnosis_id.label("diagnosis"), r.at, r.confirmed_by,
            r.since, r.campaign_id.label("campaign"), r.recording_id.label("recording"), r.took_hours, r.came,
            r.came_text,
        )  # fmt: skip
        with self._database.reading() as connection:
            return records_of(RoundRow, connection.execute(query.where(r.diagnosis_id == diagnosis).order_by(r.number)))

    def campaign_of_recipe(self, recipe_name: str) -> int | None:
        """Return the campaign that was written down for the recipe of a round, by its name; None for none yet."""
        c = tables.campaigns.c
        with self._database.reading() as connection:
            return connection.scalar(sa.select(sa.func.min(c.id)).where(c.recipe_name == recipe_name))

    def experiments(self, campaigns: Sequence[int]) -> set[int]:
        """Return which of some campaigns were experiments of a diagnosis."""
        r = tables.diagnosis_rounds.c
        with self._database.reading() as connection:
            rows = connection.execute(sa.select(r.campaign_id).where(r.campaign_id.in_(campaigns)))
            return {row.campaign_id for row in rows}

    @transaction
    def add_round(self, diagnosis: int, new: NewRound, state: DiagnosisState, outcome: str, at: datetime) -> None:
        """Write down a criticism with its decision: the next state, and the outcome where it is the end.

        Raises Conflict where another process has written the round meanwhile.
        """
        d, r = tables.diagnoses, tables.diagnosis_rounds
        last = sa.select(sa.func.coalesce(sa.func.max(r.c.number), 0)).where(r.c.diagnosis_id == diagnosis)
        ended: dict[str, object] = {"outcome": outcome, "why": new.why, "ended_at": at} if state == "done" else {}
        with self._database.writing() as connection:
            mine = sa.update(d).where(d.c.id == diagnosis, d.c.state == "criticising").values(state=state, **ended)
            if connection.scalar(last) != new.number - 1 or connection.execute(mine).rowcount != 1:
                raise _taken(diagnosis, f"round {new.number}")
            values = {
                **asdict(new), "recordings": list(new.recordings), "named": list(new.named),
                "suspects": dict(new.suspects), "experiment": None if new.experiment is None else dict(new.experiment),
            }  # fmt: skip
            connection.execute(sa.insert(r).values(**values, diagnosis_id=diagnosis, at=at, since=at))
            detail = {"round": new.number, "verdict": new.verdict, "named": list(new.named), "decided": new.why}
            append(connection, at, "diagnosis round", _subject(diagnosis), detail)

    @transaction
    def confirm(self, diagnosis: int, number: int, by: str, at: datetime) -> None:
        """Write down who has confirmed the experiment of a round. Raises Conflict where none waits for it."""
        with self._database.writing() as connection:
            self._move(connection, diagnosis, ("awaiting_confirmation",), "measuring", f"round {number}")
            self._change_round(connection, diagnosis, number, {"confirmed_by": by, "since": at})
            append(connection, at, "diagnosis confirm", _subject(diagnosis), {"round": number, "by": by})

    @transaction
    def unconfirm(self, diagnosis: int, number: int, why: str, at: datetime) -> None:
        """Have a person confirm an experiment again that was not begun in time. Raises Conflict."""
        with self._database.writing() as connection:
            self._move(connection, diagnosis, ("measuring",), "awaiting_confirmation", f"round {number}")
            self._change_round(connection, diagnosis, number, {"confirmed_by": "", "since": at})
            append(connection, at, "diagnosis missed", _subject(diagnosis), {"round": number, "reason": why})

    @transaction
    def note_campaign(self, diagnosis: int, number: int, campaign: int) -> None:
        """Write down which campaign is the experiment of a round; the same one again changes nothing."""
        with self._database.writing() as connection:
            self._change_round(connection, diagnosis, number, {"campaign_id": campaign})

    @transaction
    def conclude_round(
        self,
        diagnosis: int,
        number: int,
        came: ExperimentResult,
        text: str,
        recording: int | None,
        took_hours: float,
        at: datetime,
    ) -> None:
        """Write down what came of an experiment: all recordings are to be judged again. Raises Conflict."""
        values = {"came": came, "came_text": text, "recording_id": recording, "took_hours": took_hours}
        with self._database.writing() as connection:
            self._move(connection, diagnosis, ("awaiting_confirmation", "measuring"), "criticising", f"round {number}")
            self._change_round(connection, diagnosis, number, values)
            detail = {"round": number, "came": came, "text": text, "recording": recording}
            append(connection, at, "diagnosis experiment", _subject(diagnosis), detail)

    @transaction
    def reject_recording(self, diagnosis: int, number: int, text: str, at: datetime) -> None:
        """Write down that the recording of an experiment cannot be judged with the others: it is left out. Raises
        Conflict.
        """
        r = tables.diagnosis_rounds
        mine = sa.update(r).where(r.c.diagnosis_id == diagnosis, r.c.number == number, r.c.came == "measured")
        values = {"came": "cannot_be_done", "came_text": text, "recording_id": None}
        with self._database.writing() as connection:
            if connection.execute(mine.values(**values)).rowcount != 1:
                raise _taken(diagnosis, f"round {number}")
            append(connection, at, "diagnosis experiment", _subject(diagnosis), {"round": number, "text": text})

    @transaction
    def halt(
        self, diagnosis: int, was: Sequence[DiagnosisState], state: DiagnosisState, why: str, at: datetime
    ) -> None:
        """Stop a diagnosis, or note that it failed. Raises Conflict where it is in none of the states `was`."""
        with self._database.writing() as connection:
            self._move(connection, diagnosis, was, state, "its state", {"why": why})
            append(connection, at, f"diagnosis {state}", _subject(diagnosis), {"reason": why})

    @transaction
    def resume(self, diagnosis: int, state: DiagnosisState, number: int | None, why: str, at: datetime) -> None:
        """Let a diagnosis that was stopped or has failed go on; `number` is its round that is not over.

        Raises Conflict for any other.
        """
        with self._database.writing() as connection:
            self._move(connection, diagnosis, ("stopped", "failed"), state, "its state")
            if number is not None:
                self._change_round(connection, diagnosis, number, {"since": at})
            append(connection, at, "diagnosis resume", _subject(diagnosis), {"reason": why})

    @transaction
    def end(self, diagnosis: int, outcome: DiagnosisOutcome, why: str, at: datetime) -> None:
        """End a diagnosis for good, whatever its state. Raises Conflict for one that has ended."""
        values = {"outcome": outcome, "why": why, "ended_at": at}
        with self._database.writing() as connection:
            self._move(connection, diagnosis, OPEN, "done", "its end", values)
            append(connection, at, "diagnosis end", _subject(diagnosis), {"outcome": outcome, "reason": why})

    def _rows(self, condition: sa.ColumnElement[bool]) -> list[DiagnosisRow]:
        d = tables.diagnoses
        with self._database.reading() as connection:
            rows = connection.execute(sa.select(d).where(condition).order_by(d.c.id.desc())).mappings()
            return [record_of(DiagnosisRow, row) for row in rows]

    @staticmethod
    def _move(
        connection: sa.Connection,
        diagnosis: int,
        was: Sequence[DiagnosisState],
        state: DiagnosisState,
        what: str,
        values: Mapping[str, object] = {},
    ) -> None:
        d = tables.diagnoses
        change = sa.update(d).where(d.c.id == diagnosis, d.c.state.in_(was)).values(state=state, **values)
        if connection.execute(change).rowcount != 1:
            raise _taken(diagnosis, what)

    @staticmethod
    def _change_round(connection: sa.Connection, diagnosis: int, number: int, values: Mapping[str, object]) -> None:
        r = tables.diagnosis_rounds
        mine = sa.update(r).where(r.c.diagnosis_id == diagnosis, r.c.number == number, r.c.came == "")
        if connection.execute(mine.values(**values)).rowcount != 1:
            raise _taken(diagnosis, f"round {number}")


def _subject(diagnosis: int) -> str:
    return f"diagnosis {diagnosis}"


def _taken(diagnosis: int, what: str) -> Conflict:
    return Conflict(
        f"diagnosis {diagnosis}: {what} was changed in the meantime; read the diagnosis again, then repeat the request"
    )
