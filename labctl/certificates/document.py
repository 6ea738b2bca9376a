"""The certificate as data: every fact once. XML and PDF are made from it, and its JSON is stored.

Facts are those of ISO/IEC 17025:2017, 7.8.2.1 and 7.8.4.1; docs/reference/certificate.md has where each one is.
"""

from __future__ import annotations

import hashlib
from datetime import date, datetime
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from instruments.laboratory import Laboratory
from labctl.answers.certificates import Customer, DecisionRule, Use
from labctl.answers.output_units import nominal_text
from labctl.canonical_json import canonical

SCHEMA = "labctl-certificate/1"
TITLE = "Calibration certificate"
#: What a statement rests on: data sets that were measured to verify, or those that were fitted.
Evidence = Literal["verification", "fitted"]


class Part(BaseModel):
    """A part of the certificate; it is written once and not changed."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Item(Part):
    """What was calibrated, and how it came."""

    description: str
    manufacturer: str
    model: str
    serial: str
    identification: str = ""  #: the customer's own, where there is one
    axes: tuple[str, ...]
    condition: str
    received: date | None  #: None: not critical to the validity of the results


class Method(Part):
    """How it was calibrated."""

    name: str
    procedure: str  #: number of the laboratory's written procedure; empty: none
    plan_hash: str | None  #: of the steps that were run; None: the recording was imported
    model: str  #: error model that was fitted
    effects: tuple[str, ...]
    recordings: tuple[int, ...]
    software: str
    deviations: str


class StandardUsed(Part):
    """A reference standard with the certificate that its traceability rests on."""

    quantity: str
    name: str
    u: float
    unit: str
    certificate: str
    issued_by: str
    calibrated: date | None
    due: date | None
    traceability: str


class Condition(Part):
    """An environmental condition as it was measured: least and largest reading, or mean where means were recorded."""

    name: str
    unit: str
    low: float
    high: float


class NominalScale(Part):
    """How an output becomes a rate before it is corrected: (output - offset) / scale."""

    axis: str
    unit: str
    offset: float  #: output at rest, in `unit`
    scale: float  #: output per deg/s, in `unit` per deg/s

    @property
    def text(self) -> str:
        """The line as the certificate states it."""
        return f"axis {self.axis}: {nominal_text(self.unit, self.offset, self.scale)}"


class Contribution(Part):
    """A line of the budget: what a source adds to the standard uncertainty of a corrected rate."""

    source: str
    type: Literal["A", "B"]
    contribution_dps: float
    freedom: float | None  #: degrees of freedom; None: infinite


class Uncertainty(Part):
    """How the expanded uncertainties are to be read, and the budget of the largest of them."""

    coverage_probability: float
    axis: str
    rate_dps: float
    temperature_c: float | None
    budget: tuple[Contribution, ...]


class ResultPoint(Part):
    """Error of indication at one rate and temperature: output by its nominal scale minus true rate."""

    axis: str
    temperature_c: float | None  #: None: the calibration knows no temperature
    rate_dps: float
    error_dps: float
    expanded_dps: float
    k: float  #: coverage factor


class AnyAxisResult(Part):
    """Largest U of a corrected rate where the item turns about any axis, up to a rate; None: not known, and why."""

    output: str
    reach_dps: float
    expanded_dps: float | None  #: in the frame of the case
    aligned_expanded_dps: float | None  #: up to a rotation of the frame: for an item that is aligned in use
    across: tuple[str, ...] = ()  #: axes without an output
    per_dps_across: float | None = None  #: error per deg/s about them, with the coverage of U
    why: str = ""


class CoefficientResult(Part):
    """A coefficient of the model, by which the output is corrected."""

    axis: str
    name: str
    temperature_c: float | None  #: of a node of a temperature table
    value: float
    u: float | None  #: standard uncertainty; None: not known
    unit: str
    has_standards: bool = False  #: whether u contains the standards of the bench; else it is that of the fit alone

    @property
    def name_text(self) -> str:
        """The name as a person reads it; no correction undoes a delay or a finite bandwidth."""
        return self.name.replace("_", " ") + (" (not corrected)" if self.name in {"delay", "time_constant"} else "")


class AxisError(Part):
    """Errors of one axis over all data sets, deg/s."""

    axis: str
    rms_dps: float
    max_dps: float


class StateOfItem(Part):
    """Errors before or after the adjustment."""

    basis: str  #: what the output was corrected by
    datasets: int
    axes: tuple[AxisError, ...]


class ConformityResult(Part):
    """The decision at one rate vector and temperature that was measured to verify."""

    output: str
    rates_dps: tuple[float, float, float]  #: true rate about x, y and z
    temperature_c: float | None  #: None: the calibration knows no temperature
    error_dps: float  #: of the corrected rate
    expanded_dps: float
    k: float
    acceptance_dps: float
    passed: bool
    risk: float  #: probability that the error is beyond the limit (JCGM 106:2012, 9.3), without prior knowledge of it


class Conformity(Part):
    """A statement of conformity with the rule that it was decided by, and what it holds for."""

    specification: str
    limit_dps: float
    rule: DecisionRule
    guard_band_dps: float
    guard_band_factor: float | None = None  #: guard band over U; None: issued before it was stated, when it was 1 or 0
    acceptance_dps: float
    largest_error_dps: float
    expanded_dps: float
    passed: bool
    about: Use | None = None  #: None: issued before it was stated, when it meant the axis of each output alone
    evidence: Evidence = "fitted"
    datasets: int | None = None  #: that it rests on; None: issued before it was stated
    results: tuple[ConformityResult, ...] = ()  #: of a verification part
    statement: str


class TypeOfItem(Part):
    """Other units of the model of the item, from which a drift was taken that is not known of the item itself."""

    model: str
    units: int
    over_years: tuple[float, float]  #: shortest and longest history of a unit
    mean_per_year_dps: float  #: size of their mean drift at the worst place; its sign is not the same at all places
    freedom: float  #: degrees of freedom of the standard uncertainty
    expanded_about_mean_dps: float  #: half width about the mean until the date, with the coverage of U


class StabilityResult(Part):
    """What the item is expected to drift by until the next calibration; None: not known, and why."""

    until: date
    years: float
    per_year_dps: float | None  #: standard uncertainty at the worst place; of this item alone, root mean square
    intervals: int  #: between calibrations of this item
    drift_dps: float | None  #: half width, with the coverage of U
    about: Use = "own axis"  #: rotations at which the errors were compared
    why: str = ""
    type: TypeOfItem | None = None  #: None: the drift is that of this item by its own calibrations


class SensorCoefficient(Part):
    """A coefficient of an accelerometer or magnetometer with its expanded uncertainty."""

    name: str
    value: float
    u: float  #: combined standard uncertainty, with that of the reference where it is stated
    expanded: float
    k: float
    unit: str


class SensorReference(Part):
    """The quantity by which a sensor was calibrated: local gravity, or the size of the local field."""

    quantity: str
    value: float
    u: float | None  #: standard uncertainty; None: not stated, and not in the coefficients
    unit: str
    traceability: str  #: empty: none


class SensorResult(Part):
    """The calibration of the item's accelerometer or magnetometer."""

    sensor: Literal["accelerometer", "magnetometer"]
    version: int
    hash: str  #: SHA-256 of the stored result
    files: tuple[str, ...]  #: name and SHA-256 of each file that was fitted
    performed_from: date
    performed_until: date
    included_by: str  #: who issued the certificate with it
    formula: str
    reference: SensorReference
    coefficients: tuple[SensorCoefficient, ...]
    verdict: Literal["adequate", "unexplained"]
    found: tuple[str, ...]  #: what the fit found, in sentences
    holds_for: str
    not_stated: str  #: what was not measured, and is not stated


class Authorisation(Part):
    """Who authorised the results: the act of certification, and its release where two persons have to agree."""

    name: str
    at: datetime
    reason: str
    identity: str = ""  #: how it is known that it was this person; empty: issued before it was stated
    released_by: str = ""  #: the second person; empty: none was needed
    released_identity: str = ""

    @property
    def persons(self) -> str:
        """Who authorised, with the identity of each."""
        first = f"{self.name} ({self.identity})" if self.identity else self.name
        return f"{first}, released by {self.released_by} ({self.released_identity})" if self.released_by else first


class Replaced(Part):
    """The certificate that this one replaces."""

    number: str
    hash: str
    reason: str


class CalibrationFacts(Part):
    """The calibration that is certified, and where it is found."""

    version: int
    hash: str
    address: str


class ManifestNamed(Part):
    """The manifest of a record, by which paper and database are compared; `labctl check` names manifests by number."""

    record: str
    manifest: int  #: its number in the chain
    hash: str  #: SHA-256


class Signatory(Part):
    """Who signs the PDF and the DCC: what the certificate (X.509) of the signing key states."""

    subject: str  #: as RFC 4514 writes it
    issuer: str
    fingerprint: str  #: SHA-256 of the certificate in DER form


class Certificate(Part):
    """All of it."""

    schema_: str = Field(default=SCHEMA, alias="schema")
    title: str = TITLE
    number: str
    issued_on: date
    issued_by: str
    issued_by_identity: str = ""  #: as of the authorisation
    state_address: str = (
        ""  #: of the page that says which state the certificate is in; empty: issued before there was one
    )
    replaces: Replaced | None
    laboratory: Laboratory
    customer: Customer
    item: Item
    method: Method
    performed_from: date
    performed_until: date
    environment: tuple[Condition, ...]
    standards: tuple[StandardUsed, ...]
    uncertainty: Uncertainty
    nominal: tuple[NominalScale, ...] = ()  #: none: issued before it was stated
    results: tuple[ResultPoint, ...]
    any_axis: tuple[AnyAxisResult, ...] = ()  #: none: issued before it was stated
    coefficients: tuple[CoefficientResult, ...]
    sensors: tuple[SensorResult, ...] = ()  #: accelerometer and magnetometer, where the order names them
    as_found: StateOfItem
    as_left: StateOfItem
    adjustment: str
    conformity: Conformity | None  #: None: none was ordered
    due: date | None  #: of the next calibration; None: not agreed with the customer
    stability: StabilityResult | None = None  #: None: no date is stated, or issued before it was stated
    external: str  #: results of external providers
    authorised: Authorisation
    calibration: CalibrationFacts
    manifests: tuple[ManifestNamed, ...] = ()  #: of the recordings and the certification; none: issued before 0017
    statements: tuple[str, ...]
    signed_by: Signatory | None = None  #: of the PDF and the DCC; None: no signing key was set, or issued before

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, populate_by_name=True)

    def to_bytes(self) -> bytes:
        """Return its JSON, always the same bytes."""
        return canonical(self.model_dump(mode="json", by_alias=True)) + b"\n"


def identity_of(key: str | None) -> str:
    """Return how it is known that a person acted: by the API key of this name, or by nothing but the name."""
    return f"key {key}" if key else "name as typed, no key"


def hash_of_certificate(content: bytes) -> str:
    """Return the SHA-256 of a certificate's JSON."""
    return hashlib.sha256(content).hexdigest()
