"""The state of every certificate of a unit, from the records: the only place where it is decided.

withdrawn: by its number, or with its version when that was revoked. amended: another certificate of the same version
replaces it. superseded: another version of the unit was certified later, and has a certificate. valid: none of these.
A state goes before those after it in this list. None comes back by itself: a certificate stays amended or superseded
when the one that took its place is withdrawn. It then says so, and names only a valid one as the one to use instead.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from labctl.answers.certificates import CertificateResponse, CertificateState, SignatoryResponse
from labctl.services.standards.usage import Notices
from labctl.store import CertificateRow, CertificationRow, Store


@dataclass(frozen=True)
class _Change:
    """What a certificate is, since when and why."""

    state: CertificateState
    since: datetime
    reason: str
    by: str
    by_key: str | None


def list_certificates(store: Store, serial: str) -> list[CertificateResponse]:
    """Return every certificate of a unit with its state, newest first. Raises NotFound."""
    known_serial = store.units.get(serial).serial
    notices = Notices.of(store)
    behind = {row.version: row.recordings for row in store.calibrations.of_unit(known_serial)} if notices.bad else {}
    return [
        row.model_copy(update={"notices": list(notices.of_recordings(behind.get(row.version, ())))})
        for row in stated(store.certificates.of_unit(known_serial), store.calibrations.history(known_serial))
    ]


def certificate_by_number(store: Store, number: str) -> CertificateResponse:
    """Return a certificate with its state. Raises NotFound."""
    serial = store.certificates.get(number).serial
    return next(certificate for certificate in list_certificates(store, serial) if certificate.number == number)


def stated(rows: Sequence[CertificateRow], acts: Sequence[CertificationRow]) -> list[CertificateResponse]:
    """Return certificates of one unit with their states; `rows` and acts of certifying and revoking newest first."""
    amended_by = {row.replaces: row for row in rows if row.replaces}
    certified = {act.version: act for act in reversed(acts) if act.act == "certify"}  # the last time of each version
    order = [act.version for act in reversed(acts) if act.act == "certify" and act is certified[act.version]]
    newest = {row.version: row for row in reversed(rows)}  # of each version
    last = next((newest[version] for version in reversed(order) if version in newest), None)
    revoked = {act.version: act for act in acts[::-1] if act.act == "revoke"}
    newest_acts = {act.version: act.act for act in acts[::-1]}
    gone = {version: act for version, act in revoked.items() if newest_acts[version] == "revoke"}
    changes = {row.number: _change(row, amended_by, last, certified, gone) for row in rows}
    valid = next((number for number, change in changes.items() if change.state == "valid"), None)
    return [_response(row, changes[row.number], amended_by.get(row.number), last, valid) for row in rows]


def _change(
    row: CertificateRow,
    amended_by: Mapping[str, CertificateRow],
    last: CertificateRow | None,
    certified: Mapping[int, CertificationRow],
    revoked: Mapping[int, CertificationRow],
) -> _Change:
    if (gone := row.withdrawal) is not None:
        return _Change("withdrawn", gone.at, gone.reason, gone.by, gone.by_key)
    if (act := revoked.get(row.version)) is not None:  # revoked while the certificate was being written
        return _Change("withdrawn", act.at, act.reason, act.by, act.by_key)
    if (amendment := amended_by.get(row.number)) is not None:
        reason = amendment.reason
        if _is_gone(amendment, revoked):
            reason += f"; certificate {amendment.number}, which replaces it, was withdrawn"
        return _Change("amended", amendment.at, reason, amendment.by, amendment.by_key)
    if last is not None and last.version != row.version:
        act = certified[last.version]
        too = ", which was withdrawn" if _is_gone(last, revoked) else ""
        reason = f"version {last.version} of the unit was certified, and has certificate {last.number}{too}"
        return _Change("superseded", max(act.at, last.at), reason, act.by, act.by_key)
    return _Change("valid", row.at, "", row.by, row.by_key)


def _is_gone(row: CertificateRow, revoked: Mapping[int, CertificationRow]) -> bool:
    return row.withdrawal is not None or row.version in revoked


def _response(
    row: CertificateRow,
    change: _Change,
    amendment: CertificateRow | None,
    last: CertificateRow | None,
    valid: str | None,
) -> CertificateResponse:
    superseded = last is not None and last.version != row.version and last.number == valid
    return CertificateResponse(
        serial=row.serial, version=row.version, number=row.number, issued_at=row.at, by=row.by, by_key=row.by_key,
        hash=row.hash, replaces=row.replaces, reason=row.reason,
        replaced_by=amendment.number if amendment else None,
        superseded_by=last.number if last is not None and superseded else None,
        state=change.state, state_since=change.since, state_reason=change.reason, state_by=change.by,
        state_by_key=change.by_key, valid_instead=valid if valid != row.number else None,
        signed_by=None if row.signed_by is None else SignatoryResponse.model_validate(row.signed_by),
    )  # fmt: skip
