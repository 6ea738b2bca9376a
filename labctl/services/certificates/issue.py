"""Issue of a certificate: refused, or made in its three forms and recorded; the same request gives the same bytes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import date, datetime
from importlib.metadata import version as package_version

from instruments.standards import Standard
from labctl.calibration import read_calibration
from labctl.certificates.dcc import dcc_of
from labctl.certificates.document import (
    Authorisation,
    CalibrationFacts,
    Certificate,
    Condition,
    Item,
    Method,
    Replaced,
    StandardUsed,
    StateOfItem,
    Uncertainty,
    hash_of_certificate,
)
from labctl.certificates.pdf import pdf_of
from labctl.errors import BadInput, Conflict, NotEnoughData
from labctl.fitting.uncertainty.rate import COVERAGE
from labctl.services.certificates import measured
from labctl.services.certificates.address import address_of
from labctl.services.certificates.conformity import conformity
from labctl.services.certificates.facts import Facts, facts_of
from labctl.services.certificates.missing import MissingFacts
from labctl.services.certificates.statements import statements
from labctl.services.criticism.measurements import Measurements
from labctl.services.schemas.certificates import CertificateOrder, CertificateRequest, CertificateResponse
from labctl.store import CertificateForms, CertificateRow, Store

#: Coverage probability that belongs to k = 2 of a normal distribution (GUM, annex G).
PROBABILITY = 0.95
NONE = "None."


class CertificateRefused(Conflict):
    """A certificate may not be issued; the text says why, and what to do."""

    slug = "certificate-refused"


@dataclass(frozen=True)
class Found:
    """What the recordings of a version show."""

    measurements: Measurements | None = None  #: None: there are none
    results: measured.Results = field(default_factory=measured.Results)
    conditions: tuple[Condition, ...] = ()

    @staticmethod
    def of(store: Store, facts: Facts) -> Found:
        """Return it for a version; nothing where no recording holds measurements."""
        if not facts.recordings:
            return Found()
        measurements = Measurements(store, facts.recordings)
        results = measured.results(store, facts.row, facts.calibration)
        return Found(measurements, results, measured.environment(measurements.points))

    def missing(self) -> Iterator[tuple[str, str]]:
        """Yield what is not known of the results, and what makes it known."""
        yield from self.results.missing()
        if self.measurements is not None and not any(each.unit == "°C" for each in self.conditions):
            yield "temperature of the item or of the chamber", "a recording with temperature_c or chamber_c"


def issue(store: Store, serial: str, version: int, request: CertificateRequest, at: datetime) -> CertificateResponse:
    """Issue the certificate of a version at an aware time; one that was issued is answered as it is.

    Raises NotFound, MissingFacts, CertificateRefused, Conflict where other facts are given for one that was issued.
    """
    kept = store.certificates.newest(store.units.get(serial).serial, version)
    if kept is not None and request.amend is None:
        return response(_unchanged(kept, request))
    if kept is None and request.amend is not None:
        raise CertificateRefused(f"{serial} version {version} has no certificate to amend; issue one without --amend")
    order = CertificateOrder.model_validate(kept.order) if kept and not _given(request) else request.order
    facts = facts_of(store, serial, version, order)
    found = Found.of(store, facts)
    refuse(facts, found)
    certificate = _certificate(store, facts, found, request, at, kept)
    document = certificate.to_bytes()
    xml = dcc_of(certificate)
    forms = CertificateForms(document, xml, pdf_of(certificate, xml))
    row = CertificateRow(
        certificate.number, serial, version, kept.number if kept else None, request.amend or "", request.by, at,
        hash_of_certificate(document), order.model_dump(mode="json", exclude_defaults=True),
    )  # fmt: skip
    return response(store.certificates.add(row, forms))


def _given(request: CertificateRequest) -> dict[str, object]:
    """Return the facts that a request states."""
    return request.order.model_dump(mode="json", exclude_defaults=True)


def _unchanged(kept: CertificateRow, request: CertificateRequest) -> CertificateRow:
    """Return what was issued; raises Conflict where the request states other facts of the order."""
    given = _given(request)
    if given and given != kept.order:
        other = ", ".join(sorted(name for name in {*given, *kept.order} if given.get(name) != kept.order.get(name)))
        raise CertificateRefused(
            f"certificate {kept.number} of {kept.serial} version {kept.version} was issued with another {other}; "
            "to replace it: --amend REASON (amend)"
        )
    return kept


def refuse(facts: Facts, found: Found) -> None:
    """Raise MissingFacts, or CertificateRefused for a revoked version and a standard outside its dates."""
    if missing := [*facts.missing(), *found.missing()]:
        raise MissingFacts(facts.what, missing)
    act = facts.authorised
    if act is not None and act.act == "revoke":
        raise CertificateRefused(
            f"{facts.what} was revoked at {act.at:%Y-%m-%d %H:%M} UTC by {act.by} ({act.reason}); certify a version "
            "that holds, and issue its certificate"
        )
    first, last, received = facts.performed_from, facts.performed_until, facts.order.item.received
    if first is not None and received is not None and received > first:
        raise CertificateRefused(
            f"[item] of the order: received = {received} is after the calibration of {facts.what} began, {first}; "
            "correct the date"
        )
    if (
        first is not None
        and last is not None
        and (bad := [each for each in facts.standards if _off(each, first, last)])
    ):
        said = "; ".join(
            f"{each.label}: calibrated {each.calibrated or 'on no stated day'}, due {each.due}" for each in bad
        )
        raise CertificateRefused(
            f"no certificate of {facts.what}: measured from {first} to {last} with a reference standard outside its "
            f"dates. {said}. Have it calibrated and measure again"
        )


def _off(standard: Standard, first: date, last: date) -> bool:
    return standard.is_overdue(last) or (standard.calibrated is not None and standard.calibrated > first)


def _certificate(
    store: Store, facts: Facts, found: Found, request: CertificateRequest, at: datetime, kept: CertificateRow | None
) -> Certificate:
    first, last, act = facts.performed_from, facts.performed_until, facts.authorised
    if first is None or last is None or act is None or found.measurements is None:
        raise MissingFacts(facts.what, [])  # refused before
    before, left, adjustment = _states(store, facts, found.measurements)
    order, number = facts.order, _number(store, facts, at)
    return Certificate(
        number=number,
        issued_on=at.date(),
        issued_by=request.by,
        replaces=Replaced(number=kept.number, hash=kept.hash, reason=request.amend or "") if kept else None,
        laboratory=facts.laboratory,
        customer=order.customer,
        item=_item(facts),
        method=_method(facts),
        performed_from=first,
        performed_until=last,
        environment=found.conditions,
        standards=tuple(_standard(each) for each in facts.standards),
        uncertainty=Uncertainty(
            coverage_factor=COVERAGE, coverage_probability=PROBABILITY,
            components=("coefficients of the model", "error of the model", "repeatability from power-on to power-on"),
        ),
        results=found.results.points,
        coefficients=measured.coefficients(facts.calibration),
        as_found=before,
        as_left=left,
        adjustment=adjustment,
        conformity=conformity(order.conformity, left, found.results.points) if order.conformity else None,
        due=act.due_at.date() if order.state_due and act.due_at else None,
        external=order.external or NONE,
        authorised=Authorisation(name=act.by, at=act.at, reason=act.reason),
        calibration=CalibrationFacts(
            version=facts.row.version, hash=facts.row.hash, address=address_of(facts.laboratory.url, facts.row)
        ),
        statements=(*statements(facts), *found.results.left_out),
    )  # fmt: skip


def _number(store: Store, facts: Facts, at: datetime) -> str:
    """Return the next number of the laboratory and year."""
    prefix = facts.laboratory.number_prefix
    return f"{prefix}{at.year:04d}-{store.certificates.count_of_year(at.year, prefix) + 1:04d}"


def _item(facts: Facts) -> Item:
    given = facts.order.item
    return Item(
        description=given.description, manufacturer=given.manufacturer, serial=facts.row.serial,
        model=facts.calibration.document["unit"]["model"], identification=given.identification,
        axes=facts.calibration.axes, condition=given.condition, received=given.received,
    )  # fmt: skip


def _method(facts: Facts) -> Method:
    return Method(
        name=facts.method,
        procedure=facts.laboratory.procedure,
        plan_hash=None if facts.campaign is None else facts.campaign.schedule_hash,
        model=facts.row.model,
        effects=tuple(facts.row.answer["model"]["effects"]),
        recordings=facts.row.recordings,
        software=f"labctl {package_version('labctl')}",
        deviations=facts.order.method.deviations or NONE,
    )


def _standard(given: Standard) -> StandardUsed:
    return StandardUsed(
        quantity=given.quantity, name=given.name, u=given.standard_u, unit=given.unit_name,
        certificate=given.certificate, issued_by=given.issued_by, calibrated=given.calibrated, due=given.due,
        traceability=given.traceability,
    )  # fmt: skip


def _states(store: Store, facts: Facts, found: Measurements) -> tuple[StateOfItem, StateOfItem, str]:
    """Return the errors as found and as left, and what was adjusted between."""
    row, calibration = facts.row, facts.calibration
    left = measured.corrected(found, calibration, f"the calibration that is certified, version {row.version}")
    before = _version_before(store, facts)
    new = f"The coefficients of the correction were determined anew: version {row.version}."
    said = f"{new} {facts.order.adjustment or 'Nothing else was adjusted or repaired.'}"
    if before is not None:
        document, _ = store.calibrations.document(row.serial, before)
        try:
            basis = f"the calibration in force before, version {before}"
            return measured.corrected(found, read_calibration(document), basis), left, said
        except (BadInput, NotEnoughData):  # its model needs what was not recorded this time
            pass
    return measured.uncorrected(found, calibration.axes), left, said


def _version_before(store: Store, facts: Facts) -> int | None:
    """Return the version that was in force when this one was certified first; None: none was."""
    acts = store.calibrations.history(facts.row.serial)[::-1]
    first = next((i for i, act in enumerate(acts) if act.version == facts.row.version), 0)
    return acts[first - 1].version if first and acts[first - 1].act == "certify" else None


def response(row: CertificateRow, replaced_by: str | None = None) -> CertificateResponse:
    """Return a certificate as an answer."""
    return CertificateResponse(
        serial=row.serial, version=row.version, number=row.number, issued_at=row.at, by=row.by, hash=row.hash,
        replaces=row.replaces, reason=row.reason, replaced_by=replaced_by,
    )  # fmt: skip
