"""Certification of a version: the request, the act as it was kept, and the assessment before it."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from labctl.answers.base import BY_KEY, Request, ResponseModel
from labctl.answers.budget import CrossRatesJson
from labctl.answers.common_fields import (
    ActTime,
    CalibrationHash,
    FittedRms,
    HeldoutRms,
    InForce,
    NoiseFloor,
    Person,
    PersonName,
    RawRms,
    Reason,
    Serial,
    StatedReason,
    VersionNumber,
)
from labctl.answers.judgement import DueSource, Objection

#: The longest interval between two calibrations of a unit, days.
MAX_DUE_DAYS = 36_500


def _due_days(days: int) -> int:
    if not 0 <= days <= MAX_DUE_DAYS:
        words = "the next calibration cannot be due in {days} days; give from 1 to {limit} days, or 0 for no due date"
        raise PydanticCustomError("due_days", words, {"days": days, "limit": MAX_DUE_DAYS})
    return days


DueDays = Annotated[int, AfterValidator(_due_days), Field(json_schema_extra={"minimum": 0, "maximum": MAX_DUE_DAYS})]
CAUSE_NOT_KNOWN = (
    "What an adequate model does not show, in sentences: of effects that the data could not tell from others when they "
    "were added the error is corrected, the cause is not known; a formula is a description and no cause."
)
DUE_FROM = "Source of the number of days; null: no number is given, and there is no due date."
WHEN = "Time of the verdict, which is the time of the certification."
NO_VERDICT = (
    "Verdict of the newest criticism of the version on the recording that it was fitted to; null: none, see "
    "`verdict_reason`."
)


class AnyAxisUncertainty(ResponseModel):
    """Largest U of one output over all rate vectors up to the calibrated rate, about any axis."""

    bound_dps: float | None = Field(description="U in the frame of the case, deg/s; null: unknown somewhere.")
    aligned_bound_dps: float | None = Field(description="U up to a rotation of the frame, deg/s.")
    reach_dps: float = Field(description="Largest magnitude of the rate vectors, deg/s.")
    rates_dps: dict[str, float] = Field(description="Rate vector where U is largest, or unknown, deg/s.")
    temperature_c: float = Field(description="Temperature there, deg C.")
    why: str = Field(description="Why it is unknown; empty where it is known.")
    cross_rates: CrossRatesJson | None = Field(description="null: every body axis has an output.")


class RevokeRequest(Request):
    """Who revokes a version, and why."""

    by: PersonName
    reason: StatedReason = Field(min_length=1)
    due_days: DueDays | None = Field(
        default=None,
        description="Only for a certification: days until the next calibration is due; 0: no due date; absent: "
        "the number in the recipe (`recalibrate_after_days`), else in the service ($LABCTL_DUE_DAYS), else no "
        "due date.",
    )


class CertifyRequest(RevokeRequest):
    """Who certifies a version, and why."""

    override: bool = Field(
        default=False, description="Certify although there are objections; the reason must then be a sentence."
    )


class ReleaseRequest(Request):
    """Who releases, as the second person, what a first one asked to certify, and why."""

    by: PersonName
    reason: StatedReason = Field(min_length=1)


class ReleaseRequestResponse(ResponseModel):
    """A version that waits for its release by a second person; it is not in force yet."""

    serial: Serial
    version: VersionNumber
    by: Person
    by_key: str = Field(description="Name of the API key of the first person; the second needs another one.")
    reason: Reason
    at: ActTime
    due_days: int | None = Field(
        description="Days until the next calibration is due, as the first person asked for; 0: no due date; null: "
        "by recipe or service."
    )
    override: bool = Field(description="Whether the version is to be certified although there are objections.")
    waits_for_release: Literal[True] = Field(
        default=True, description="Always true: the version is not in force before a second person releases it."
    )


class CertifiedErrors(ResponseModel):
    """Errors that a version states, deg/s."""

    raw_rms_dps: RawRms = None
    rms_dps: FittedRms = None
    heldout_rms_dps: HeldoutRms = None
    noise_floor_dps: NoiseFloor = None


class AssessmentResponse(ResponseModel):
    """What is known of a version when it is to be certified."""

    serial: Serial
    version: VersionNumber
    verdict: str | None = Field(description=NO_VERDICT)
    verdict_reason: str = Field(description="Why there is no verdict; empty if there is one.")
    verdict_recording: int | None = Field(description="Recording that the verdict is of; null: there is no verdict.")
    verdict_text: str = Field(description="The verdict in words; empty if there is none.")
    cause_not_known: list[str] = Field(default_factory=list, description=CAUSE_NOT_KNOWN)
    error: CertifiedErrors = Field(description="Errors that the version states, deg/s.")
    any_axis: dict[str, AnyAxisUncertainty] = Field(
        description="For each output: its largest U in use, or why it is unknown, which is no objection; empty: the "
        "version states none."
    )
    objections: list[Objection] = Field(description="Objections to certifying the version; empty: none.")
    in_force: InForce = False
    override_needed: bool = Field(description="Whether the version can be certified only with `override`.")
    least_reason_characters: int = Field(description="Smallest number of characters of the reason for an override.")
    least_reason_words: int = Field(description="Smallest number of words of the reason for an override.")
    due_days: int | None = Field(
        description="Days for which a certification is valid if the request gives no number; null: no due date."
    )
    due_from: DueSource | None = Field(description=DUE_FROM)


class FetchResponse(ResponseModel):
    """Who fetched a version over HTTP: one entry for each key, and one for all who sent none."""

    who: str = Field(description="Name of the API key; anonymous: no key was sent.")
    first_at: datetime = Field(description="Time of the first fetch.")
    last_at: datetime = Field(description="The last fetch; if the service was killed, up to an hour too early.")


class WithdrawnResponse(ResponseModel):
    """When, by whom and why a version or its certificate was withdrawn."""

    at: ActTime
    by: Person
    reason: Reason
    certificate: str = Field(description="Number of the certificate; empty: the version was revoked.")


class CalibrationStateResponse(ResponseModel):
    """State of a version whose file a program holds, found by the hash of its calibration."""

    serial: Serial
    version: VersionNumber
    calibration_hash: CalibrationHash
    state: Literal["in-force", "superseded", "revoked", "not-certified"] = Field(
        description="in-force: the unit's certified version; superseded: another version was certified later; "
        "revoked: its certification was revoked; not-certified: it was never certified."
    )
    due: datetime | None = Field(description="Date until which the certification is valid; null: no date.")
    withdrawn: WithdrawnResponse | None = Field(
        description="The version was revoked, or its certificate was withdrawn after the version was certified last."
    )
    in_force: int | None = Field(description="Version of the unit that is in force; null: none.")


class CertificationResponse(ResponseModel):
    """A certification or its revocation; without a verdict's keys for a revocation and before verdicts were kept."""

    serial: Serial
    version: VersionNumber
    act: Literal["certify", "revoke"] = Field(
        description="Whether the version was certified or its certification revoked."
    )
    by: Person
    by_key: str | None = Field(default=None, description=BY_KEY)
    reason: Reason
    at: ActTime
    due: datetime | None = Field(
        default=None, description="Time until which the certification is valid; null: no due date."
    )
    due_from: DueSource | None = Field(default=None, description=DUE_FROM)
    verdict: str | None = Field(default=None, description=NO_VERDICT)
    verdict_reason: str | None = Field(default=None, description="Why there is no verdict; empty if there is one.")
    verdict_recording: int | None = Field(
        default=None, description="Recording that the verdict is of; null: there is no verdict."
    )
    verdict_at: datetime | None = Field(default=None, description=WHEN)
    verdict_text: str | None = Field(default=None, description="The verdict in words.")
    cause_not_known: list[str] = Field(default_factory=list, description=CAUSE_NOT_KNOWN)
    error: CertifiedErrors | None = Field(
        default=None, description="Errors that the version stated at its certification, deg/s; null: not kept."
    )
    override: bool | None = Field(
        default=None, description="Whether the version was certified although there were objections."
    )
    objections: list[Objection] = Field(
        default_factory=list, description="Objections to certifying the version at that time; empty: none."
    )
    released_by: str | None = Field(default=None, description="The second person; null: none was needed.")
    released_key: str | None = Field(default=None, description="Name of the API key of the second person.")
    release_reason: str | None = Field(
        default=None, description="Reason that the second person gave; null: none was needed."
    )
    uncertainty_unknown: str | None = Field(
        default=None,
        description="Why the uncertainty in use was unknown at the certification; empty: it was known; null: not kept.",
    )
    withdrawn_certificates: list[str] = Field(
        default_factory=list, description="Only in the answer to a revocation: certificates that it withdrew."
    )
    already_in_force: Literal["unchanged", "renewed"] | None = Field(
        default=None,
        description="Only in the answer to a certification of the version that was in force already. unchanged: on "
        "the same day (UTC), by the same person, for the same reason, with the same verdict, objections and due date, "
        "and no certificate was withdrawn since: nothing was written, and this is the act that stands; renewed: this "
        "act was written in addition. null: the version was not in force.",
    )
    fetched_by: list[FetchResponse] = Field(
        default_factory=list, description="Only in the answer to a revocation: who has to be notified."
    )
