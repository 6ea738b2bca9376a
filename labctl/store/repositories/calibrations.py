"""Calibrations: immutable, numbered per unit; certification is a record beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal

import sqlalchemy as sa
from sqlalchemy import exc

from labctl.answers.judgement import JudgementDetail
from labctl.answers.kept_answers import KeptAnswer
from labctl.errors import Conflict, NotCertified, NotFound, VersionTaken
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.manifests.contents import CALIBRATION, CERTIFICATION
from labctl.store.paging import parts_of
from labctl.store.records import CalibrationRecord, CertificationRow, Judgement, Release, Withdrawal
from labctl.store.repositories.audit import append
from labctl.store.repositories.drafts.transitions import mark_fitted
from labctl.store.repositories.releases import waits
from labctl.store.repositories.units import SEEN
from labctl.store.repositories.withdrawals import withdraw_of_version
from labctl.store.schema import tables
from labctl.store.sealing.seals import seal


@dataclass(frozen=True)
class FitError:
    """Error of a version on the data that it was fitted to, and their noise floor, deg/s; None: not known."""

    version: int
    rms_dps: float | None
    noise_floor_dps: float | None


def _document_query() -> sa.Select[bytes, str]:
    c = tables.calibrations.c
    return sa.select(c.document, c.hash).where(c.serial == sa.bindparam("serial"))


def _in_force_query() -> sa.Select[bytes, str]:
    x = tables.certifications.c
    last = sa.select(sa.func.max(x.id)).where(x.serial == sa.bindparam("serial")).scalar_subquery()
    act = sa.select(x.version).where(x.id == last, x.act == "certify").scalar_subquery()
    return _document_query().where(tables.calibrations.c.version == act)


def _acts_query() -> sa.Select[*tuple[Any, ...]]:
    """Return the query of a unit's acts of certifying and revoking, newest first."""
    x = tables.certifications.c
    columns = (x.serial, x.version, x.act, x.by, x.reason, x.at, x.due_at)
    judgement = (x.verdict, x.verdict_recording, x.verdict_at, x.override, x.assessment)
    persons = (x.by_key, x.released_by, x.released_key, x.release_reason, x.request_id)
    return sa.select(*columns, *judgement, *persons).where(x.serial == sa.bindparam("serial")).order_by(x.id.desc())


_ACTS = _acts_query()


def _act(row: sa.Row[Any]) -> CertificationRow:
    judgement = None
    if row.override is not None:
        detail: JudgementDetail = row.assessment or JudgementDetail()
        judgement = Judgement(row.verdict, row.verdict_recording, row.verdict_at, bool(row.override), detail)
    release = None
    if row.released_by is not None:
        release = Release(row.released_by, row.released_key, row.release_reason, row.request_id)
    return CertificationRow(
        row.serial, row.version, row.act, row.by, row.reason, row.at, row.due_at, judgement, row.by_key, release
    )


def _judgement_columns(judgement: Judgement | None) -> dict[str, Any]:
    if judgement is None:
        return {}
    return {
        "verdict": judgement.verdict, "verdict_recording": judgement.recording, "verdict_at": judgement.at,
        "override": judgement.override, "assessment": dict(judgement.detail),
    }  # fmt: skip


def _release_columns(release: Release | None) -> dict[str, Any]:
    if release is None:
        return {}
    return {
        "released_by": release.by, "released_key": release.by_key, "release_reason": release.reason,
        "request_id": release.request,
    }  # fmt: skip


def _audited(judgement: Judgement) -> dict[str, Any]:
    """Return what the audit trail keeps of a judgement, so that a later change of its row shows."""
    return {
        "verdict": judgement.verdict, "recording": judgement.recording,
        "verdict_at": judgement.at.isoformat() if judgement.at else None, "override": judgement.override,
        "objections": [each["text"] for each in judgement.detail.get("objections", [])],
    }  # fmt: skip


def _next_version(connection: sa.Connection, serial: str) -> int:
    c = tables.calibrations.c
    return int(connection.scalar(sa.select(sa.func.max(c.version)).where(c.serial == serial)) or 0) + 1


def _add_recordings(connection: sa.Connection, calibration: int | None, recordings: Sequence[int]) -> None:
    values = [{"calibration_id": calibration, "recording_id": recording} for recording in recordings]
    if values:
        connection.execute(sa.insert(tables.calibration_recordings), values)


#: Built once: the queries behind every GET.
_DOCUMENT = _document_query().where(tables.calibrations.c.version == sa.bindparam("version"))
_IN_FORCE = _in_force_query()


@dataclass(frozen=True)
class NewCalibration:
    """A calibration about to be kept; `document` and `answer` know their version number."""

    parent: int | None
    recording: int | None
    model: str
    document: bytes
    hash: str
    answer: KeptAnswer
    recordings: tuple[int, ...] = ()  #: all that it was fitted to, where there are several
    is_draft: bool = False  #: of the campaign that made its recording

    @property
    def fitted_to(self) -> tuple[int, ...]:
        """All recordings that it was fitted to, rising."""
        one = () if self.recording is None else (self.recording,)
        return tuple(sorted({*self.recordings, *one}))


def add_version(connection: sa.Connection, serial: str, at: datetime, version: int, new: NewCalibration) -> None:
    """Keep a unit's next version inside a transaction, with its audit row and its seal. Raises VersionTaken."""
    values = {
        "serial": serial, "version": version, "parent": new.parent, "recording_id": new.recording,
        "model": new.model, "created_at": at, "hash": new.hash, "document": new.document, "answer": new.answer,
    }  # fmt: skip
    if _next_version(connection, serial) != version:
        raise _taken(serial, version)
    c = tables.calibrations.c
    number = connection.scalar(sa.insert(tables.calibrations).values(**values).returning(c.id))
    _add_recordings(connection, number, new.fitted_to)
    if new.is_draft and new.recording is not None:
        mark_fitted(connection, new.recording, version)
    detail: dict[str, Any] = {
        "model": new.model, "recording": new.recording, "parent": new.parent, "hash": new.hash,
    }  # fmt: skip
    if len(new.fitted_to) > 1:
        detail["recordings"] = list(new.fitted_to)
    act = "fit" if new.parent is None else "improve"
    append(connection, at, act, f"{serial} version {version}", detail)
    seal(connection, (CALIBRATION.name, str(number)), at, act)


def _taken(serial: str, version: int) -> VersionTaken:
    return VersionTaken(f"{serial} version {version} was made by another fit in the meantime; fit again")


class Calibrations:
    """Every calibration of every unit."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def next_version(self, serial: str) -> int:
        """Return the number that a unit's next version will have, unless another one is added before it."""
        with self._database.reading() as connection:
            return _next_version(connection, serial)

    @transaction
    def add(self, serial: str, at: datetime, version: int, new: NewCalibration) -> CalibrationRecord:
        """Keep a unit's next version, which was built with its number.

        Raises VersionTaken when another one got the number meanwhile, Conflict when the draft of its recording was
        made meanwhile; nothing was changed.
        """
        try:
            with self._database.writing() as connection:
                add_version(connection, serial, at, version, new)
        except exc.IntegrityError as error:  # where several processes write: after the look, before the end
            if self.next_version(serial) == version:
                raise
            raise _taken(serial, version) from error
        return CalibrationRecord(
            serial, version, new.parent, new.recording, new.model, at, new.hash, new.document, new.answer, new.fitted_to
        )

    def get(self, serial: str, version: int) -> CalibrationRecord:
        """Return one version; raises NotFound."""
        rows = self._rows(tables.calibrations.c.serial == serial, tables.calibrations.c.version == version)
        if not rows:
            raise NotFound(
                f"unit {serial!r} has no calibration version {version}; `labctl ladder {serial}` lists the versions"
            )
        return rows[0]

    def version_of(self, serial: str, hash_: str) -> int | None:
        """Return the version of a unit whose calibration has a hash; None where none has."""
        c = tables.calibrations.c
        with self._database.reading() as connection:
            return connection.scalar(sa.select(c.version).where(c.serial == serial, c.hash == hash_))

    def of_unit(self, serial: str) -> list[CalibrationRecord]:
        """Return every version of a unit, newest first."""
        return self._rows(tables.calibrations.c.serial == serial)

    def newest_errors(self, serials: Sequence[str], most: int) -> dict[str, list[FitError]]:
        """Return, of each of some units, the errors of its newest versions on the data they were fitted to, rising."""
        c = tables.calibrations.c
        some_of = c.serial.in_(sa.bindparam("serials", expanding=True))
        place = sa.func.row_number().over(partition_by=c.serial, order_by=c.version.desc()).label("place")
        newest = sa.select(c.id, place).where(some_of).subquery()  # without the answers, which are long
        error = c.answer["error"]
        query = (
            sa.select(c.serial, c.version, error["rms_dps"].as_float(), error["noise_floor_dps"].as_float())
            .join(newest, newest.c.id == c.id)
            .where(newest.c.place <= most)
            .order_by(c.serial, c.version)
        )
        errors: dict[str, list[FitError]] = {}
        with self._database.reading() as connection:
            for some in parts_of(serials):
                for serial, version, rms_dps, floor_dps in connection.execute(query, {"serials": some}):
                    errors.setdefault(serial, []).append(FitError(version, rms_dps, floor_dps))
        return errors

    def _rows(self, *conditions: sa.ColumnElement[bool]) -> list[CalibrationRecord]:
        c = tables.calibrations.c
        query = sa.select(
            c.id, c.serial, c.version, c.parent, c.recording_id, c.model, c.created_at, c.hash, c.document, c.answer
        ).where(*conditions)
        r = tables.calibration_recordings.c
        of = sa.select(r.calibration_id, r.recording_id).join(tables.calibrations, c.id == r.calibration_id)
        fitted_to: dict[int, list[int]] = {}
        with self._database.reading() as connection:
            rows = connection.execute(query.order_by(c.version.desc())).all()
            for number, recording in connection.execute(of.where(*conditions).order_by(r.recording_id)):
                fitted_to.setdefault(number, []).append(recording)
        return [
            CalibrationRecord(
                row.serial, row.version, row.parent, row.recording_id, row.model, row.created_at, row.hash,
                row.document, row.answer, tuple(fitted_to.get(row.id, ())),
            )
            for row in rows
        ]  # fmt: skip

    def certified_version(self, serial: str) -> int:
        """Return the version in force; raises NotCertified."""
        act = self._last_act(serial)
        if act is None or act.act != "certify":
            raise NotCertified(
                f"unit {serial!r} has no certified calibration; "
                f"`labctl certify {serial} VERSION --by NAME --reason TEXT` puts a version in force; `--version "
                "N` uses a version that is not in force"
            )
        return act.version

    def _last_act(self, serial: str) -> CertificationRow | None:
        with self._database.reading() as connection:
            row = connection.execute(_ACTS.limit(1), {"serial": serial}).first()
        return None if row is None else _act(row)

    @transaction
    def certify(
        self,
        serial: str,
        version: int,
        act: Literal["certify", "revoke"],
        *,
        by: str,
        reason: str,
        at: datetime,
        due_at: datetime | None = None,
        who: str | None = None,
        judgement: Judgement | None = None,
        by_key: str | None = None,
        release: Release | None = None,
    ) -> CertificationRow:
        """Put a version in force, or take the one in force out of it, with its certificates. Raises NotFound, Conflict.

        `by` is the person who answers for it; `who` is the one who did it, where that is known otherwise than from
        `by`; `by_key` is the API key that acted; `judgement` is what was known of the version; `release` is who
        released what `by` asked for.
        """
        self.get(serial, version)
        last = self._last_act(serial)
        in_force = last.version if last is not None and last.act == "certify" else None
        if act == "revoke" and in_force != version:
            raise Conflict(
                f"{serial} version {version} is not in force (in force: {in_force or 'none'}); give the version in "
                "force"
            )
        row = CertificationRow(serial, version, act, by, reason, at, due_at, judgement, by_key, release)
        with self._database.writing() as connection:
            if release is not None and not waits(connection, release.request, serial, version):
                raise Conflict(
                    f"{serial} version {version} does not wait for this release any more; read `labctl "
                    f"certifications {serial}`"
                )
            number = connection.scalar(
                sa.insert(tables.certifications).values(
                    serial=serial, version=version, act=act, by=by, reason=reason, at=at, due_at=due_at,
                    by_key=by_key, **_judgement_columns(judgement), **_release_columns(release),
                ).returning(tables.certifications.c.id)
            )  # fmt: skip
            detail: dict[str, Any] = {"by": by, "reason": reason, "due": due_at.isoformat() if due_at else None}
            detail |= {} if judgement is None else _audited(judgement)
            detail |= {} if release is None else {"released_by": release.by, "release_reason": release.reason}
            append(connection, at, act, f"{serial} version {version}", detail, who=who or by)
            seal(connection, (CERTIFICATION.name, str(number)), at, act)
            if act == "revoke":
                withdraw_of_version(connection, serial, version, Withdrawal(by, by_key, reason, at, number))
        return row

    def document(self, serial: str, version: int | None) -> tuple[bytes, str]:
        """Return the bytes and hash of a version, or of the one in force: the point read behind every GET."""
        with self._database.reading() as connection:
            if version is None:
                row = connection.execute(_IN_FORCE, {"serial": serial}).first()
            else:
                row = connection.execute(_DOCUMENT, {"serial": serial, "version": version}).first()
        if row is not None:
            return bytes(row[0]), str(row[1])
        with self._database.reading() as connection:
            known_serial = connection.scalar(
                sa.select(tables.units.c.serial).where(tables.units.c.serial == serial, SEEN)
            )
        if known_serial is None:
            raise NotFound(f"unit {serial!r} is not in this database; `labctl import DIR` or a campaign adds it")
        if version is None:
            self.certified_version(serial)  # says why there is none
        raise NotFound(
            f"unit {serial!r} has no calibration version {version}; `labctl ladder {serial}` lists the versions"
        )

    def history(self, serial: str) -> list[CertificationRow]:
        """Return every act of certifying and revoking, newest first."""
        with self._database.reading() as connection:
            return [_act(row) for row in connection.execute(_ACTS, {"serial": serial})]

    def versions(self, serial: str) -> list[int]:
        """Return a unit's version numbers, rising."""
        c = tables.calibrations.c
        with self._database.reading() as connection:
            return [
                int(v) for v in connection.scalars(sa.select(c.version).where(c.serial == serial).order_by(c.version))
            ]
