"""A certificate, put together from facts that were found to be whole."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime
from importlib.metadata import version as package_version

from instruments.standards import Standard
from labctl.acting_user import acting_key
from labctl.answers.certificates import CertificateRequest
from labctl.calibration import read_calibration
from labctl.certificates.document import (
    Authorisation,
    CalibrationFacts,
    Certificate,
    Item,
    ManifestNamed,
    Method,
    NominalScale,
    Replaced,
    StandardUsed,
    StateOfItem,
    identity_of,
)
from labctl.errors import BadInput, NotEnoughData
from labctl.services.calibrations.uncertainty import widening_of
from labctl.services.certificates import measured
from labctl.services.certificates.address import address_of, page_of
from labctl.services.certificates.conformity import conformity
from labctl.services.certificates.evidence import errors_of
from labctl.services.certificates.facts import Facts
from labctl.services.certificates.found import Found
from labctl.services.certificates.missing import MissingFacts
from labctl.services.certificates.stability import stability_until, until
from labctl.services.criticism.measurements import Measurements
from labctl.store import CertificateRow, CertificationRow, Store

ITEM_ONLY = "The results relate only to the item that is identified here, in the condition in which it was received."
WHOLE = "This certificate may be reproduced only in full, unless the laboratory has agreed otherwise in writing."
BY_CUSTOMER = "Customer, order number and the customer's own number of the item were stated by the customer."
TRACEABLE = (
    "The results are metrologically traceable to the SI through the reference standards that are listed, whose "
    "uncertainties enter the uncertainty that is stated."
)
NOISE = "The noise of a single reading is not contained in the uncertainty."
SIMULATED = (
    "SPECIMEN: instruments of the bench are simulated. This document has no metrological value and is no certificate."
)


def statements(facts: Facts) -> tuple[str, ...]:
    """Return the statements in order; of a simulated bench that it is simulated first, and none on traceability."""
    statement_texts = [ITEM_ONLY, TRACEABLE, NOISE, BY_CUSTOMER, WHOLE, *_of_type(facts), *_causes_not_known(facts)]
    return (SIMULATED, *statement_texts[:1], *statement_texts[2:]) if facts.simulated else tuple(statement_texts)


NONE = "None."


def assembled(
    store: Store, facts: Facts, evidence: Found, request: CertificateRequest, at: datetime, kept: CertificateRow | None
) -> Certificate:
    """Return the certificate with the next number of the laboratory. Raises MissingFacts, BadInput, NotEnoughData."""
    first, last, act = facts.performed_from, facts.performed_until, facts.authorised
    measurements, uncertainty = evidence.measurements, evidence.results.uncertainty
    if first is None or last is None or act is None or measurements is None or uncertainty is None:
        raise MissingFacts.of(facts.what, [])  # refused before
    before, after, adjustment = _states(store, facts, measurements)
    order, number = facts.order, _number(store, facts, at)
    stability = stability_until(store, facts, act.due_at) if order.state_due and act.due_at else None
    return Certificate(
        number=number,
        state_address=page_of(facts.laboratory.url, number, facts.row.hash),
        issued_on=at.date(),
        issued_by=request.by,
        issued_by_identity=identity_of(acting_key()),
        replaces=Replaced(number=kept.number, hash=kept.hash, reason=request.amend or "") if kept else None,
        laboratory=facts.laboratory,
        customer=order.customer,
        item=_item(facts),
        method=_method(facts),
        performed_from=first,
        performed_until=last,
        environment=(*evidence.conditions, *evidence.room),
        standards=tuple(_standard(standard) for standard in facts.standards),
        uncertainty=uncertainty,
        nominal=tuple(_nominal(facts)),
        results=evidence.results.points,
        any_axis=evidence.results.any_axis,
        coefficients=measured.coefficients(facts.calibration),
        sensors=tuple(facts.sensors.results(order, request.by)),
        as_found=before,
        as_left=after,
        adjustment=adjustment,
        conformity=None if order.conformity is None else conformity(
            order.conformity, errors_of(measurements, facts.calibration, order.conformity.about),
            evidence.results.points, evidence.results.any_axis, evidence.results.left_out,
            widening_of(facts.calibration, order.conformity.about), stability,
        ),
        due=None if stability is None else stability.until,
        stability=stability,
        external=order.external or NONE,
        authorised=_authorisation(act),
        calibration=CalibrationFacts(
            version=facts.row.version, hash=facts.row.hash, address=address_of(facts.laboratory.url, facts.row)
        ),
        manifests=tuple(_manifests(store, facts)),
        statements=(*statements(facts), *until(stability, evidence.results.points), *evidence.results.left_out),
    )  # fmt: skip


def _authorisation(act: CertificationRow) -> Authorisation:
    """Return who authorised the results; the person who released them too, where two persons have to agree."""
    second = act.release
    return Authorisation(
        name=act.by, at=act.at, reason=act.reason, identity=identity_of(act.by_key),
        released_by=second.by if second else "", released_identity=identity_of(second.by_key) if second else "",
    )  # fmt: skip


def _manifests(store: Store, facts: Facts) -> Iterator[ManifestNamed]:
    """Yield the manifests of the recordings that were fitted, and of the certification."""
    for number in facts.row.recordings:
        if (manifests := store.manifests.of_recording(number)) is not None:
            yield ManifestNamed(record=f"recording {number}", manifest=manifests.sequence, hash=manifests.hash)
    act = store.manifests.of_certification(facts.row.serial, facts.row.version)
    if act is not None:
        yield ManifestNamed(record=f"certification of {facts.what}", manifest=act.sequence, hash=act.hash)


def _number(store: Store, facts: Facts, at: datetime) -> str:
    """Return the next number of the laboratory and year."""
    prefix = facts.laboratory.number_prefix
    return f"{prefix}{at.year:04d}-{store.certificates.count_of_year(at.year, prefix) + 1:04d}"


def _item(facts: Facts) -> Item:
    item = facts.order.item
    return Item(
        description=item.description, manufacturer=item.manufacturer, serial=facts.row.serial,
        model=facts.calibration.document["unit"]["model"], identification=item.identification,
        axes=facts.calibration.axes, condition=item.condition, received=item.received,
    )  # fmt: skip


def _of_type(facts: Facts) -> Iterator[str]:
    """Yield what other units contributed to the coefficients: evidence that is not from this item."""
    prior = facts.calibration.document["provenance"].get("type_prior")
    if isinstance(prior, dict) and prior.get("is_used"):
        yield (
            f"The coefficients were estimated from the measurements of this item together with the calibrations of "
            f"{prior['units']} other units of type {prior['type']}; the measured errors are of this item alone."
        )


def _nominal(facts: Facts) -> Iterator[NominalScale]:
    """Yield the nominal line of each output, to which its errors and the coefficients are relative."""
    for axis, line in facts.calibration.output.items():
        yield NominalScale(axis=axis, unit=line.unit, offset=line.offset, scale=line.scale)


def _causes_not_known(facts: Facts) -> Iterator[str]:
    """Yield of which parts of the certified model the verdict does not show the cause."""
    if (act := facts.authorised) is not None and act.judgement is not None:
        for text in act.judgement.detail.get("cause_not_known", ()):
            yield f"On the error model: {text}"


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


def _standard(standard: Standard) -> StandardUsed:
    return StandardUsed(
        quantity=standard.quantity, name=standard.name, u=standard.standard_u, unit=standard.unit_name,
        certificate=standard.certificate, issued_by=standard.issued_by, calibrated=standard.calibrated,
        due=standard.due, traceability=standard.traceability,
    )  # fmt: skip


def _states(store: Store, facts: Facts, measurements: Measurements) -> tuple[StateOfItem, StateOfItem, str]:
    """Return the errors as found and as left, and what was adjusted between."""
    row, calibration = facts.row, facts.calibration
    after = measured.corrected(
        measurements, calibration, f"the calibration that is certified, version {row.version}", calibration
    )
    before = _version_before(store, facts)
    new = f"The coefficients of the correction were determined anew: version {row.version}."
    text = f"{new} {facts.order.adjustment or 'Nothing else was adjusted or repaired.'}"
    if before is not None:
        document, _ = store.calibrations.document(row.serial, before)
        try:
            basis = f"the calibration in force before, version {before}"
            return measured.corrected(measurements, read_calibration(document), basis, calibration), after, text
        except (BadInput, NotEnoughData):  # its model needs what was not recorded this time
            pass
    return measured.uncorrected(measurements, calibration.axes), after, text


def _version_before(store: Store, facts: Facts) -> int | None:
    """Return the version that was in force when this one was certified first; None: none was."""
    acts = store.calibrations.history(facts.row.serial)[::-1]
    first = next((i for i, act in enumerate(acts) if act.version == facts.row.version), 0)
    return acts[first - 1].version if first and acts[first - 1].act == "certify" else None
