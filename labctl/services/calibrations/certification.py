"""Certification: which version of a calibration is in force, by whom and why, and what was known of it."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Literal, cast

from labctl.acting_user import acting_key, actor
from labctl.errors import BadInput, CertificationRefused
from labctl.json_types.calibrations import JudgementDetail
from labctl.services.calibrations.assessment import LEAST_REASON_CHARACTERS, LEAST_REASON_WORDS, assess
from labctl.services.calibrations.due import interval_days
from labctl.services.calibrations.fetch_log import fetched_by
from labctl.services.schemas.certification import (
    AssessmentResponse,
    CertificationResponse,
    CertifyRequest,
    RevokeRequest,
)
from labctl.store import CertificationRow, Judgement, Store

#: What is kept of an assessment beside its verdict.
KEPT = ("verdict_reason", "verdict_text", "error", "objections")


def list_certifications(store: Store, serial: str) -> list[CertificationResponse]:
    """Return every act of certifying and revoking, newest first. Raises NotFound."""
    return [certification_response(row) for row in store.calibrations.history(store.units.get(serial).serial)]


def certification_response(row: CertificationRow) -> CertificationResponse:
    act: Literal["certify", "revoke"] = "certify" if row.act == "certify" else "revoke"
    response = CertificationResponse(
        serial=row.serial, version=row.version, act=act, by=row.by, by_key=row.by_key, reason=row.reason,
        at=row.at, due=row.due_at,
    )  # fmt: skip
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


def certify(store: Store, serial: str, version: int, request: CertifyRequest, at: datetime) -> CertificationResponse:
    """Put a version in force, and keep the verdict on it.

    Raises NotFound; CertificationRefused where there are objections and `request` does not override that;
    BadInput for an override whose reason is no sentence.
    """
    if request.override:
        _refuse_short(request.reason)
    days, due_from = interval_days(store, store.units.get(serial).serial, version, request.due_days)
    known = assess(store, serial, version)
    if known.objections and not request.override:
        raise CertificationRefused(refusal(known))
    judgement = Judgement(
        known.verdict, known.verdict_recording, at if known.verdict else None, bool(known.objections),
        cast(JudgementDetail, {**known.model_dump(mode="json", include=set(KEPT)), "due_from": due_from}),
    )  # fmt: skip
    due = None if days is None else at + timedelta(days=days)
    return _set_in_force(store, serial, version, "certify", request, at, due, judgement)


def revoke(store: Store, serial: str, version: int, request: RevokeRequest, at: datetime) -> CertificationResponse:
    """Revoke the certification of a version, and withdraw its certificates. Raises NotFound, Conflict.

    The answer names these, and who fetched the version and has to be told.
    """
    known = store.units.get(serial).serial
    before = {row.number for row in store.certificates.of_unit(known) if row.withdrawal is not None}
    answer = _set_in_force(store, serial, version, "revoke", request, at)
    withdrawn = [
        row.number
        for row in reversed(store.certificates.of_unit(known))
        if row.version == version and row.number not in before
    ]
    told = {"withdrawn_certificates": withdrawn, "fetched_by": fetched_by(store, known, version)}
    return answer.model_copy(update=told)


def _set_in_force(
    store: Store,
    serial: str,
    version: int,
    act: Literal["certify", "revoke"],
    request: RevokeRequest,
    at: datetime,
    due: datetime | None = None,
    judgement: Judgement | None = None,
) -> CertificationResponse:
    caller = actor()
    row = store.calibrations.certify(
        serial, version, act, by=request.by, reason=request.reason, at=at, due_at=due, judgement=judgement,
        who=caller.name if caller.via == "key" else request.by, by_key=acting_key(),
    )  # fmt: skip
    return certification_response(row)


def refusal(known: AssessmentResponse) -> str:
    """Return in one message why a version is not certified, and what to do; of wrong data only the first is said."""
    data = [each for each in known.objections if each.what == "data"]
    said = [each for each in known.objections if each not in data[1:]]
    more = f" (and {len(data) - 1} more in its data)" if len(data) > 1 else ""
    objections = "; ".join(each.text for each in said)
    todo = "; ".join(dict.fromkeys(each.do for each in said))
    return (
        f"certification of version {known.version} of {known.serial} is refused: {objections}{more}. To do: {todo}. "
        "To certify it nevertheless:"
        f" --override (override: true), with a reason of at least {LEAST_REASON_CHARACTERS} "
        f"characters and {LEAST_REASON_WORDS} words"
    )


def _refuse_short(reason: str) -> None:
    """Raise BadInput for a reason that is no sentence."""
    words = reason.split()
    if len(words) < LEAST_REASON_WORDS or len(" ".join(words)) < LEAST_REASON_CHARACTERS:
        raise BadInput(
            f"--reason {reason!r} is too short for an override: say in a sentence of at least "
            f"{LEAST_REASON_CHARACTERS} characters and {LEAST_REASON_WORDS} words why this version is used nevertheless"
        )
