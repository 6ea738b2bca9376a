"""Certificates: the facts of an order, the request, and what was issued."""

from __future__ import annotations

import math
from datetime import date, datetime
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from instruments.laboratory import Contact, Laboratory
from labctl.answers.base import BY_KEY, LongText, Request, ResponseModel
from labctl.answers.common_fields import CertificateNumber, PersonName, Serial, StatedReason, VersionNumber

#: Of ILAC-G8:09/2019: 4.2.1 simple acceptance; 4.2.2 a guard band as wide as the expanded uncertainty.
DecisionRule = Literal["simple", "guard-band"]
#: Rotations that a statement holds for: about any axis, or about the axis of each output with the others at rest.
Use = Literal["any axis", "own axis"]
#: Most characters of a text, and of one that is one line of a certificate.
TEXT, LINE = 2000, 300
#: Tables of an order in which a mandatory fact can be stated.
OrderTable = Literal["laboratory", "customer", "item", "method", "accelerometer", "magnetometer"]
CertificateState = Literal["valid", "amended", "superseded", "withdrawn"]

# descriptions of the state of a certificate, for those who keep it and for the public
STATE = (
    "withdrawn: by its number, or with its version; amended: another certificate of the version replaces it "
    "(`replaced_by`); superseded: another version was certified later and has a certificate (`superseded_by`); valid: "
    "none of these."
)
STATE_SINCE = "When it came into this state; of a valid certificate the time of issue."
STATE_REASON = "Why it is in this state; empty for a valid certificate."
STATE_BY = "Name of the person whose act brought it into this state; of a valid certificate, who issued it."
REPLACED_BY = "Number of the certificate of the same version that was issued in place of this one; null: none."
SUPERSEDED_BY = (
    "Number of the certificate of the version that was certified last; null: it is of this version, or was withdrawn."
)
VALID_INSTEAD = "Number of the unit's valid certificate; null: it is this one, or none is valid."


def _in_order(limits: tuple[float, float]) -> tuple[float, float]:
    if not (math.isfinite(limits[0]) and math.isfinite(limits[1]) and limits[0] <= limits[1]):
        raise ValueError(f"{list(limits)}: give the least value, then the largest")
    return limits


class Customer(Contact):
    """Who ordered the calibration."""

    contact: str = Field(default="", description="Person to ask.")
    order: str = Field(default="", description="Order number of the customer.")


class OrderedItem(Request):
    """What the laboratory noted of the item when it came."""

    description: str = Field(
        default="Gyroscope", max_length=LINE, description="Kind of item, as the certificate names it."
    )
    manufacturer: str = Field(default="", max_length=LINE, description="Manufacturer of the item; empty: not stated.")
    identification: str = Field(default="", max_length=LINE, description="The customer's own number of the item.")
    condition: LongText = Field(default="", max_length=TEXT, description="Condition of the item on receipt.")
    received: date | None = Field(
        default=None,
        description="Date of receipt, at most 10 years before the first day of measurement and not after it; null: the "
        "results do not depend on it.",
    )


class OrderedMethod(Request):
    """What is to be said of the method beside the recipe."""

    name: str = Field(
        default="",
        max_length=LINE,
        description="Name of the method; only for an imported recording, since a campaign names its recipe.",
    )
    deviations: LongText = Field(
        default="", max_length=TEXT, description="Additions to, deviations or exclusions from the method; empty: none."
    )
    performed_from: date | None = Field(
        default=None,
        description="First day of the measurements; only for an imported recording, since a campaign knows its dates.",
    )
    performed_until: date | None = Field(
        default=None, description="Last day of the measurements; only for an imported recording; null: the same day."
    )


class OrderedConformity(Request):
    """The specification to which conformity is to be stated, and the rule."""

    specification: str = Field(min_length=1, max_length=LINE, description="Specification, as the certificate names it.")
    limit_dps: float = Field(
        gt=0, allow_inf_nan=False, description="Largest permitted error of a corrected rate, deg/s."
    )
    about: Use = Field(
        default="any axis",
        description="Rotations that the statement holds for. any axis: rate vectors of any direction up to the "
        "calibrated rate; own axis: rotation about the axis of each output, the others at rest.",
    )
    rule: DecisionRule = Field(
        description="simple: pass up to the limit; guard-band: pass up to the limit less the expanded uncertainty."
    )


Span = Annotated[tuple[float, float], AfterValidator(_in_order)]


class RoomConditions(Request):
    """Least and largest value in the room as a person noted them; used where nothing was recorded in that time."""

    temperature_c: Span | None = Field(default=None, description="Temperature of the room, deg C.")
    humidity_pct: Span | None = Field(default=None, description="Relative humidity of the room, %.")
    pressure_hpa: Span | None = Field(default=None, description="Air pressure of the room, hPa.")


class OrderedSensor(Request):
    """A version of the unit's accelerometer or magnetometer that the certificate is to state."""

    version: int = Field(ge=1, description="Number of the version, as `labctl sensors list SERIAL` prints it.")
    performed_from: date | None = Field(default=None, description="First day of its measurements.")
    performed_until: date | None = Field(default=None, description="Last day; null: the same day.")


class OrderedAccelerometer(OrderedSensor):
    """The accelerometer, and the local gravity by which it is traceable."""

    gravity_m_s2: float | None = Field(
        default=None, ge=9.7, le=9.9, description="Gravity at the place of the measurements, m/s2."
    )
    gravity_u_m_s2: float | None = Field(default=None, gt=0, le=0.1, description="Its standard uncertainty, m/s2.")
    traceability: str = Field(
        default="",
        max_length=LINE,
        description="How that gravity is known: measurement, or gravity information system.",
    )


class OrderedMagnetometer(OrderedSensor):
    """The magnetometer; the size of the field is stated only where a magnetometer that is calibrated measured it."""

    field_ut: float | None = Field(
        default=None, gt=0, le=1e6, description="Size of the field at the place of the measurements, uT."
    )
    field_u_ut: float | None = Field(default=None, gt=0, le=1e6, description="Its standard uncertainty, uT.")
    traceability: str = Field(default="", max_length=LINE, description="How that field is known.")


class CertificateOrder(Request):
    """The facts of the order: what a campaign cannot know. They are kept with the certificate."""

    customer: Customer = Field(default=Customer(), description="The customer who ordered the calibration.")
    item: OrderedItem = Field(default=OrderedItem(), description="The item as the laboratory received it.")
    method: OrderedMethod = Field(
        default=OrderedMethod(), description="Facts of the method that the recipe does not state."
    )
    environment: RoomConditions = Field(
        default=RoomConditions(),
        description="Environment of the room where none was recorded (`POST /api/environment`) during the campaign.",
    )
    conformity: OrderedConformity | None = Field(
        default=None,
        description="Statement of conformity to a specification; null: the certificate makes no statement.",
    )
    accelerometer: OrderedAccelerometer | None = Field(
        default=None, description="Version of the unit's accelerometer to state; null: none."
    )
    magnetometer: OrderedMagnetometer | None = Field(
        default=None, description="Version of the unit's magnetometer to state; null: none."
    )
    adjustment: LongText = Field(default="", max_length=TEXT, description="Adjustments or repairs other than the new "
    "coefficients; empty: none.")  # fmt: skip
    external: LongText = Field(
        default="",
        max_length=TEXT,
        description="Results that came from external providers, and the names of these; empty: none.",
    )
    state_due: bool = Field(
        default=False,
        description="Whether the certificate states the date of the next calibration; only if "
        "the customer agreed to it.",
    )
    laboratory: Laboratory | None = Field(
        default=None, description="The laboratory; needed if the bench file of the campaign has no [laboratory]."
    )


class CertificateRequest(Request):
    """Issue the certificate of a version, or an amended one."""

    by: PersonName = Field(description="Name of the person who issues the certificate.")
    order: CertificateOrder = Field(
        default=CertificateOrder(), description="The facts of the order; they are kept with the certificate."
    )
    amend: StatedReason | None = Field(
        default=None,
        min_length=1,
        max_length=TEXT,
        description="Reason for replacing the version's present certificate by this one; null: do not replace it.",
    )


class MissingFactResponse(ResponseModel):
    """A mandatory fact of a certificate that is not stated."""

    fact: str = Field(description="The fact, in words.")
    where: str = Field(description="Where to state it, in words.")
    table: OrderTable | None = Field(
        description="Table of the order that can state it (`order.laboratory`, ...); null: the order cannot."
    )
    key: str = Field(default="", description="Its key in that table; empty: the order cannot state it, or has several.")
    remedy: str = Field(
        default="",
        description="What a person does where the order cannot state it, or has later certificates state it, in a "
        "sentence; else empty.",
    )


class SignatoryResponse(ResponseModel):
    """Who signed, or signs, a certificate: what the certificate (X.509) of the signing key states."""

    subject: str = Field(description="Name of the signer, as RFC 4514 writes it.")
    issuer: str = Field(description="Name of the authority that issued the certificate (X.509).")
    fingerprint: str = Field(description="SHA-256 of the certificate (X.509) in DER form.")


class WithdrawRequest(Request):
    """Withdraw a certificate; it stays withdrawn, and its bytes stay what they are."""

    number: CertificateNumber = Field(min_length=1, max_length=100)
    by: PersonName = Field(description="Name of the person who withdraws it.")
    reason: StatedReason = Field(
        min_length=1, max_length=TEXT, description="Why; the list, the file and the page say it."
    )


class CertificateResponse(ResponseModel):
    """A certificate that was issued, and its state now."""

    serial: Serial
    version: VersionNumber
    number: CertificateNumber
    issued_at: datetime = Field(description="Time of issue.")
    by: str = Field(description="Name of the person who issued the certificate.")
    by_key: str | None = Field(default=None, description=BY_KEY)
    hash: str = Field(description="SHA-256 of the certificate in its JSON form.")
    replaces: str | None = Field(
        description="Number of the earlier certificate that this certificate replaces; null: none."
    )
    reason: str = Field(description="Why this certificate replaces an earlier one; empty: it replaces none.")
    replaced_by: str | None = Field(default=None, description=REPLACED_BY)
    signed_by: SignatoryResponse | None = Field(
        default=None, description="Who signed the PDF (PAdES) and the DCC (XAdES); null: they have no signature."
    )
    superseded_by: str | None = Field(default=None, description=SUPERSEDED_BY)
    state: CertificateState = Field(default="valid", description=STATE)
    state_since: datetime | None = Field(default=None, description=STATE_SINCE)
    state_reason: str = Field(default="", description=STATE_REASON)
    state_by: str = Field(default="", description=STATE_BY)
    state_by_key: str | None = Field(default=None, description=BY_KEY)
    valid_instead: str | None = Field(default=None, description=VALID_INSTEAD)
    notices: list[str] = Field(
        default_factory=list, description="Findings on the reference standards behind it since it was issued."
    )


class PublicCertificate(ResponseModel):
    """What the page behind the QR code of a certificate says: its state, and what to compare with the paper."""

    number: CertificateNumber
    hash: str = Field(description="SHA-256 of the certificate in its JSON form.")
    calibration_hash: str = Field(description="SHA-256 of the calibration, as printed on the certificate.")
    serial: Serial
    version: VersionNumber
    laboratory: str = Field(description="Name of the laboratory that issued the certificate.")
    issued_at: datetime = Field(description="Time of issue.")
    state: CertificateState = Field(description=STATE)
    state_since: datetime | None = Field(description=STATE_SINCE)
    state_reason: str = Field(description=STATE_REASON)
    state_by: str = Field(description=STATE_BY)
    replaced_by: str | None = Field(description=REPLACED_BY)
    superseded_by: str | None = Field(description=SUPERSEDED_BY)
    valid_instead: str | None = Field(description=VALID_INSTEAD)
    notices: list[str] = Field(
        description="Findings on the reference standards behind it since it was issued; without persons and reasons."
    )
