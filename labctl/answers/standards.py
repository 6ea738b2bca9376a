"""Reference standards: what is entered in the register, and what the register answers."""

from __future__ import annotations

from datetime import date, datetime
from typing import Literal

from pydantic import AwareDatetime, Field, model_validator

from instruments.bench_config import SERIAL
from labctl.answers.base import LongText, Request, ResponseModel
from labctl.answers.common_fields import (
    ActTime,
    CertificateNumber,
    InForce,
    Person,
    PersonName,
    Reason,
    Sentences,
    Serial,
    StandardLabel,
    StatedReason,
    VersionNumber,
)

TEXT = 2000
#: No certificate states a smaller uncertainty; the square of a much smaller one has no number.
MIN_U = 1e-12
NOMINAL = "Nominal value that it holds for, in the unit of the standard; null: it holds for all."
#: valid: may be used. no certificate: nothing is known. check it: an intermediate check is out of limits.
StandardState = Literal["valid", "no certificate", "overdue", "check it", "bad"]
ChartState = Literal["in", "warning", "out", "unknown"]


class StandardRequest(Request):
    """Enter a reference standard."""

    label: str = Field(pattern=SERIAL, description="Name of the standard, as `name` in [[standards]] of a bench file.")
    quantity: str = Field(
        min_length=1, max_length=20, description="Quantity: one of a bench file, such as thermometer, "
        "clock or fixture_angle, or another one.",
    )  # fmt: skip
    unit: str | None = Field(
        default=None, min_length=1, max_length=10, description="Unit of its values; default: that of a bench file."
    )
    serial: str = Field(default="", max_length=100, description="Serial number of the standard; empty: not stated.")
    description: LongText = Field(default="", max_length=TEXT, description="Description of the standard; empty: none.")
    by: PersonName


class CertifiedPointRequest(Request):
    """What a certificate states at one nominal. The uncertainty is `u`, or `expanded` with its `k`."""

    nominal: float | None = Field(default=None, allow_inf_nan=False, description=NOMINAL)
    value: float | None = Field(
        default=None, allow_inf_nan=False, description="Error: indicated minus true, as `value` of a bench file; "
        "null: not stated."
    )  # fmt: skip
    correction: float | None = Field(
        default=None, allow_inf_nan=False, description="The error with the other sign, instead of `value`."
    )
    u: float | None = Field(default=None, ge=MIN_U, allow_inf_nan=False, description="Standard uncertainty.")
    expanded: float | None = Field(default=None, ge=MIN_U, allow_inf_nan=False, description="Expanded uncertainty.")
    k: float = Field(default=2.0, gt=0, allow_inf_nan=False, description="Coverage factor of `expanded`.")

    @model_validator(mode="after")
    def _once(self) -> CertifiedPointRequest:
        if (self.u is None) == (self.expanded is None):
            raise ValueError("give exactly one of u and expanded")
        if self.value is not None and self.correction is not None:
            raise ValueError("give value or correction, not both")
        return self


class StandardCertificateRequest(Request):
    """Enter a certificate of a standard."""

    number: CertificateNumber = Field(min_length=1, max_length=100)
    laboratory: str = Field(min_length=1, max_length=300, description="Laboratory that issued the certificate.")
    calibrated: date = Field(description="Day of the calibration.")
    due: date | None = Field(default=None, description="Last day on which the standard may be used.")
    adjusted: bool = Field(
        default=False, description="Whether the standard was adjusted or repaired before: no drift leads across it."
    )
    traceability: LongText = Field(
        default="", max_length=TEXT, description="Traceability, as the certificate states it; empty: not stated."
    )
    points: list[CertifiedPointRequest] = Field(
        min_length=1, max_length=200, description="What the certificate states at each nominal."
    )
    reason: str = Field(
        default="", max_length=TEXT, description="Why this replaces an entry of the same number that was typed wrong."
    )
    by: PersonName

    @model_validator(mode="after")
    def _consistent(self) -> StandardCertificateRequest:
        if self.due is not None and self.due < self.calibrated:
            raise ValueError(f"due {self.due} is before calibrated {self.calibrated}; correct the dates")
        nominals = [each.nominal for each in self.points]
        if twice := [each for each in nominals if each is not None and nominals.count(each) > 1]:
            raise ValueError(f"two points have the nominal {twice[0]:g}; remove one")
        if len(nominals) > 1 and None in nominals:
            raise ValueError("one of several points has no nominal; give each point a nominal")
        return self


class StandardCheckRequest(Request):
    """Enter an intermediate check (ISO/IEC 17025:2017, 6.4.10)."""

    value: float = Field(allow_inf_nan=False, description="Error that was found: indicated minus true.")
    u: float = Field(gt=0, allow_inf_nan=False, description="Standard uncertainty of the check.")
    nominal: float | None = Field(default=None, allow_inf_nan=False, description=NOMINAL)
    checked_at: AwareDatetime | None = Field(default=None, description="Default: now.")
    note: LongText = Field(default="", max_length=TEXT, description="Remark on the check; empty: none.")
    by: PersonName


class StandardBadRequest(Request):
    """Say that a standard was found bad between two days, both included."""

    bad_from: date = Field(description="First day of which it is not known that the standard was good.")
    bad_until: date | None = Field(default=None, description="Last such day; null: it is still bad.")
    reason: StatedReason = Field(min_length=1, max_length=TEXT)
    by: PersonName

    @model_validator(mode="after")
    def _in_order(self) -> StandardBadRequest:
        if self.bad_until is not None and self.bad_until < self.bad_from:
            raise ValueError(f"bad_until {self.bad_until} is before bad_from {self.bad_from}; correct the days")
        return self


class WithdrawFindingRequest(Request):
    """Withdraw a finding that was wrong."""

    reason: StatedReason = Field(min_length=1, max_length=TEXT)
    by: PersonName


class CertifiedPointResponse(ResponseModel):
    """What a certificate states at one nominal."""

    nominal: float | None = Field(description=NOMINAL)
    value: float | None = Field(description="Error: indicated minus true; null: not stated.")
    u: float = Field(description="Standard uncertainty.")
    k: float = Field(description="Coverage factor with which the certificate states it.")


class StandardCertificateResponse(ResponseModel):
    """A certificate of a standard."""

    number: CertificateNumber
    laboratory: str = Field(description="Laboratory that issued the certificate.")
    calibrated: date = Field(description="Day of the calibration.")
    due: date | None = Field(
        description="Last day on which the standard may be used by this certificate; null: the certificate has no "
        "due date."
    )
    adjusted: bool = Field(
        description="Whether the standard was adjusted or repaired before: no drift leads across it."
    )
    traceability: str = Field(description="Traceability, as the certificate states it; empty: not stated.")
    points: list[CertifiedPointResponse] = Field(description="What the certificate states at each nominal.")
    reason: str = Field(description="Why it replaced an entry of the same number; empty: it replaced none.")
    by: Person
    at: datetime = Field(description="Time of the entry in the register.")


class DriftPrediction(ResponseModel):
    """Value and uncertainty of a standard on a day, by a straight line through its certificates."""

    nominal: float | None = Field(description=NOMINAL)
    on: date = Field(description="Day of the prediction.")
    value: float | None = Field(description="Predicted error: indicated minus true; null: the certificates state none.")
    u: float = Field(description="Standard uncertainty; it contains that of the drift where the drift is known.")
    per_year: float | None = Field(description="Drift per year; null: unknown, see `why`.")
    u_per_year: float | None = Field(description="Standard uncertainty of the drift per year.")
    certificates: int = Field(description="How many certificates the line is from; 0: there is no line.")
    birge_ratio: float | None = Field(
        description="By how much the certificates scatter more than their uncertainties state; 1: they do not."
    )
    why: str = Field(description="Why the drift is unknown; empty where it is known.")


class ChartLimits(ResponseModel):
    """Control limits of one value: three standard deviations about the centre line."""

    basis: Literal["history", "stated u"] = Field(
        description="What the limits rest on: the earlier values of the chart, or the uncertainty that was stated."
    )
    centre: float = Field(description="Centre line of the chart, in the unit of the values.")
    sigma: float = Field(description="Standard deviation of the chart, in the unit of the values.")
    low: float = Field(description="Lower limit: centre minus three standard deviations.")
    high: float = Field(description="Upper limit: centre plus three standard deviations.")
    values: int = Field(description="How many earlier values the limits are from; 0: they are stated.")


class StandardCheckResponse(ResponseModel):
    """An intermediate check on the control chart of its nominal."""

    checked_at: datetime = Field(description="Time of the check.")
    nominal: float | None = Field(description=NOMINAL)
    value: float = Field(description="Error that was found: indicated minus true, in the unit of the standard.")
    u: float = Field(description="Standard uncertainty of the check, in the unit of the standard.")
    note: str = Field(description="Remark on the check; empty: none.")
    by: Person
    state: ChartState = Field(description="out: beyond three standard deviations by any of the limits.")
    limits: list[ChartLimits] = Field(description="Control limits of this check.")


class StandardFindingResponse(ResponseModel):
    """A finding that a standard was bad."""

    number: int = Field(description="Number of the finding.")
    bad_from: date = Field(description="First day of which it is not known that the standard was good.")
    bad_until: date | None = Field(description="null: it is still bad.")
    reason: Reason
    by: Person
    at: ActTime
    withdrawn: str = Field(description="Who withdrew it, when and why; empty: it is in force.")


class StandardResponse(ResponseModel):
    """A reference standard: its state on a day, and what that rests on."""

    label: StandardLabel
    serial: str = Field(description="Serial number of the standard; empty: not stated.")
    quantity: str = Field(description="Quantity that the standard realises.")
    unit: str = Field(description="Unit of its values.")
    description: str = Field(description="Description of the standard; empty: none.")
    state: StandardState = Field(
        description="valid: it may be used; no certificate: nothing is known of it; overdue: its due date has "
        "passed; check it: an intermediate check is out of limits; bad: it was found bad."
    )
    text: list[str] = Field(description="The state in sentences, with what to do.")
    due: date | None = Field(description="Last day on which it may be used, of the newest certificate.")
    certificates: list[StandardCertificateResponse] = Field(description="By day of calibration, the newest last.")
    predictions: list[DriftPrediction] = Field(description="For each nominal, on the day that was asked for.")
    checks: list[StandardCheckResponse] = Field(description="In order of time.")
    findings: list[StandardFindingResponse] = Field(description="Findings that the standard was bad, in order of time.")


class AffectedCalibration(ResponseModel):
    """A calibration that a standard was used for."""

    serial: Serial
    version: VersionNumber
    recordings: list[int] = Field(description="Its recordings that were measured with the standard.")
    campaigns: list[int] = Field(description="Campaigns that made these recordings.")
    performed_from: date | None = Field(description="null: the date of a recording is not known.")
    performed_until: date | None = Field(
        description="Last day of these measurements; null: the date of a recording is not known."
    )
    in_force: InForce
    certificates: list[str] = Field(description="Numbers of the certificates issued of it, the newest first.")
    findings: list[int] = Field(description="Findings of the standard that hold for these days.")


class AffectedResponse(ResponseModel):
    """The calibrations that a standard was used for between two days."""

    label: StandardLabel
    bad_from: date | None = Field(description="null: from the beginning.")
    bad_until: date | None = Field(description="null: until now.")
    calibrations: list[AffectedCalibration] = Field(
        description="Each calibration that the standard was used for on these days."
    )
    text: Sentences
