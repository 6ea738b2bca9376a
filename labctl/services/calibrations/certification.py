"""Certification: which version of a calibration is in force, by whom and why, and what was known of it."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timedelta
from typing import Literal

from labctl.acting_user import acting_key
from labctl.answers.certification import (
    AssessmentResponse,
    CertificationResponse,
    CertifyRequest,
    ReleaseRequest,
    ReleaseRequestResponse,
    RevokeRequest,
)
from labctl.answers.judgement import JudgementDetail
from labctl.errors import BadInput, CertificationRefused
from labctl.services.calibrations.assessment import MIN_REASON_CHARACTERS, MIN_REASON_WORDS, assess
from labctl.services.calibrations.due import interval_days
from labctl.services.calibrations.fetch_log import fetched_by
from labctl.services.calibrations.release import ask_for_release, key_of_person, needs_second_person, waiting_request
from labctl.store import CertificationRow, Judgement, Release, Store


def list_certifications(store: Store, serial: str) -> list[CertificationResponse]:
    """Return every act of certifying and revoking, newest first. Raises NotFound."""
    return [certification_response(row) for row in store.calibrations.history(store.units.get(serial).serial)]


def certification_response(row: CertificationRow) -> CertificationResponse:
    act: Literal["certify", "revoke"] = "certify" if row.act == "certify" else "revoke"
    response = CertificationResponse(
        serial=row.serial, version=row.version, act=act, by=row.by, by_key=row.by_key, reason=row.reason,
        at=row.at, due=row.due_at,
    )  # fmt: skip
    if (second := row.release) is not None:
        update = {"released_by": second.by, "released_key": second.by_key, "release_reason": second.reason}
        response = response.model_copy(update=update)
    known = row.judgement
    if known is None:
        return response
    verdict = {
        "verdict": known.verdict, "verdict_recording": known.recording, "verdict_at": known.at,
        "override": known.override, **known.detail,
    }  # fmt: skip
    return CertificationResponse.model_validate({**response.model_dump(), **verdict})


def version_in_force(store: Store, serial: str) -> int | None:
    history = store.calibrations.history(serial)
    return history[0].version if history and history[0].act == "certify" else None


def certify(
    store: Store, serial: str, version: int, request: CertifyRequest, at: datetime
) -> CertificationResponse | ReleaseRequestResponse:
    """Put a version in force, and keep the verdict on it; where two persons have to agree, ask for the second one.

    Raises NotFound; CertificationRefused where there are objections and `request` does not override that;
    BadInput for an override whose reason is no sentence; ReleaseRefused without a key where two persons are needed.
    The same certification twice writes nothing.
    """
    if request.override:
        _refuse_short(request.reason)
    store.units.get(serial)
    if needs_second_person():
        _refuse_objections(assess(store, serial, version), request)
        return ask_for_release(store, serial, version, request, at)
    return put_in_force(store, serial, version, request, at, acting_key())


def release(store: Store, serial: str, version: int, request: ReleaseRequest, at: datetime) -> CertificationResponse:
    """Put in force, as the second person, what a first one asked for. What is known of the version is assessed again.

    Raises NotFound where nothing waits, ReleaseRefused for the first person and without a key, CertificationRefused.
    """
    key = key_of_person(f"releasing {serial} version {version}")
    waiting = waiting_request(store, store.units.get(serial).serial, version, key)
    first = CertifyRequest.model_construct(  # as it was stored: a name may be longer than a new one may be
        by=waiting.by, reason=waiting.reason, due_days=waiting.due_days, override=waiting.override
    )
    second = Release(request.by, key, request.reason, waiting.id)
    return put_in_force(store, serial, version, first, at, waiting.by_key, second)


def put_in_force(
    store: Store,
    serial: str,
    version: int,
    request: CertifyRequest,
    at: datetime,
    by_key: str | None,
    second: Release | None = None,
) -> CertificationResponse:
    """Put a version in force in the name of one person, or of two; keep the verdict on it. Raises as `certify` does."""
    days, due_from = interval_days(store, store.units.get(serial).serial, version, request.due_days)
    known = assess(store, serial, version)
    _refuse_objections(known, request)
    judgement = Judgement(
        known.verdict, known.verdict_recording, at if known.verdict else None, bool(known.objections),
        JudgementDetail(
            verdict_reason=known.verdict_reason, verdict_text=known.verdict_text,
            cause_not_known=known.cause_not_known, error=known.error.model_dump(), objections=known.objections,
            due_from=due_from,
            uncertainty_unknown="; ".join(dict.fromkeys(each.why for each in known.any_axis.values() if each.why)),
        ),
    )  # fmt: skip
    due = None if days is None else at + timedelta(days=days)
    standing = _standing(store, known.serial, version)
    is_same = standing is not None and second is None and _is_same(standing, request, at, by_key, due, judgement)
    if standing is not None and is_same and not _withdrawn_since(store, standing):
        return certification_response(standing).model_copy(update={"already_in_force": "unchanged"})
    row = store.calibrations.certify(
        serial, version, "certify", by=request.by, reason=request.reason, at=at, due_at=due, judgement=judgement,
        who=acting_key() or request.by, by_key=by_key, release=second,
    )  # fmt: skip
    return certification_response(row).model_copy(update={"already_in_force": "renewed" if standing else None})


def _standing(store: Store, serial: str, version: int) -> CertificationRow | None:
    """Return the act by which a version is in force; None where it is not."""
    last = next(iter(store.calibrations.history(serial)), None)
    return last if last is not None and (last.act, last.version) == ("certify", version) else None


def _is_same(
    standing: CertificationRow,
    request: CertifyRequest,
    at: datetime,
    by_key: str | None,
    due: datetime | None,
    found: Judgement,
) -> bool:
    """Return whether a certification would say what the one that stands says, on the same day (UTC)."""
    before = standing.judgement
    if before is None or standing.release is not None:
        return False
    days = [[each and each.date() for each in times] for times in ((standing.at, standing.due_at), (at, due))]
    return (
        (standing.by, standing.by_key, standing.reason) == (request.by, by_key, request.reason)
        and days[0] == days[1]
        and replace(before, at=found.at) == found
    )


def _withdrawn_since(store: Store, standing: CertificationRow) -> bool:
    """Return whether a certificate of the version was withdrawn after the act, which vouches for it no longer."""
    issued = store.certificates.of_unit(standing.serial)
    gone = [row.withdrawal.at for row in issued if row.version == standing.version and row.withdrawal is not None]
    return any(at >= standing.at for at in gone)


def _refuse_objections(known: AssessmentResponse, request: CertifyRequest) -> None:
    if known.objections and not request.override:
        raise CertificationRefused(refusal(known))


def revoke(store: Store, serial: str, version: int, request: RevokeRequest, at: datetime) -> CertificationResponse:
    """Revoke the certification of a version, and withdraw its certificates. Raises NotFound, Conflict.

    The answer names these, and who fetched the version and has to be notified.
    """
    known = store.units.get(serial).serial
    before = {row.number for row in store.certificates.of_unit(known) if row.withdrawal is not None}
    key = acting_key()
    row = store.calibrations.certify(
        serial, version, "revoke", by=request.by, reason=request.reason, at=at, who=key or request.by, by_key=key
    )
    withdrawn = [
        row.number
        for row in reversed(store.certificates.of_unit(known))
        if row.version == version and row.number not in before
    ]
    changes = {"withdrawn_certificates": withdrawn, "fetched_by": fetched_by(store, known, version)}
    return certification_response(row).model_copy(update=changes)


def refusal(known: AssessmentResponse) -> str:
    """Return in one message why a version is not certified, and what to do; of wrong data only the first is said."""
    data = [each for each in known.objections if each["what"] == "data"]
    others = [each for each in known.objections if each not in data[1:]]
    more = f" (and {len(data) - 1} more in its data)" if len(data) > 1 else ""
    objections = "; ".join(each["text"] for each in others)
    todo = "; ".join(dict.fromkeys(each["do"] for each in others))
    return (
        f"certification of version {known.version} of {known.serial} is refused: {objections}{more}. To do: {todo}. "
        "To certify it nevertheless:"
        f" --override (override: true), with a reason of at least {MIN_REASON_CHARACTERS} "
        f"characters and {MIN_REASON_WORDS} words"
    )


def _refuse_short(reason: str) -> None:
    """Raise BadInput for a reason that is no sentence."""
    words = reason.split()
    if len(words) < MIN_REASON_WORDS or len(" ".join(words)) < MIN_REASON_CHARACTERS:
        raise BadInput(
            f"--reason {reason!r} is too short for an override: say in a sentence of at least "
            f"{MIN_REASON_CHARACTERS} characters and {MIN_REASON_WORDS} words why this version is used nevertheless"
        )
