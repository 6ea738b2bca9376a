"""The acts on the register, and a standard as the register answers it: state, drift, checks and findings."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import date, datetime
from typing import get_args

from instruments.standards import UNITS
from labctl.answers.standards import (
    CertifiedPointRequest,
    CertifiedPointResponse,
    StandardBadRequest,
    StandardCertificateRequest,
    StandardCertificateResponse,
    StandardCheckRequest,
    StandardFindingResponse,
    StandardRequest,
    StandardResponse,
    StandardState,
    WithdrawFindingRequest,
)
from labctl.errors import BadInput, Conflict, NotFound
from labctl.services.standards.checks import charted, check_answer, out_text, to_be_checked
from labctl.services.standards.predictions import prediction_answer, predictions_of
from labctl.services.standards.usage import finding_text, same_issuer
from labctl.store import (
    CertifiedPoint,
    RegisteredStandard,
    StandardCertificate,
    StandardCheck,
    StandardFinding,
    StandardRow,
    Store,
)

#: The states that have a text, the worst first.
WORST_FIRST: tuple[StandardState, ...] = ("bad", "check it", "overdue", "no certificate")


def add_standard(store: Store, request: StandardRequest, at: datetime) -> StandardResponse:
    """Enter a standard. Raises BadInput for a unit that its quantity has not, Conflict for a label that is taken."""
    units = next((units for quantity, units in UNITS.items() if quantity == request.quantity), None)
    unit_symbol = request.unit or (units[0] if units else None)
    if unit_symbol is None:
        raise BadInput(f"standard {request.label}: no usual unit of {request.quantity!r} is known; give its unit")
    if units and unit_symbol not in units:
        raise BadInput(
            f"standard {request.label}: unit {unit_symbol!r} is not accepted for {request.quantity}; give "
            f"{' or '.join(units)}"
        )
    store.standards.add(
        StandardRow(request.label, request.serial, request.quantity, unit_symbol, request.description, request.by, at)
    )  # fmt: skip
    return one_standard(store, request.label, at.date())


def add_certificate(store: Store, label: str, request: StandardCertificateRequest, at: datetime) -> StandardResponse:
    """Enter a certificate.

    Raises NotFound; BadInput for a day to come; Conflict for a number of the same laboratory that is there.
    """
    standard = store.standards.get(label)
    if request.calibrated > at.date():
        raise BadInput(
            f"certificate {request.number}: calibrated {request.calibrated} is a day to come; correct the date"
        )
    alike = [each for each in standard.certificates if each.number == request.number]
    if any(same_issuer(each.laboratory, request.laboratory) for each in alike) and not request.reason:
        raise Conflict(
            f"certificate {request.number} of standard {standard.row.label} is in the register; to correct it, send it "
            "again with the reason (--reason TEXT)"
        )
    points = tuple(_point(each) for each in request.points)
    new = StandardCertificate(
        request.number, request.laboratory, request.calibrated, request.due, request.adjusted, request.traceability,
        points, request.reason, request.by, at,
    )  # fmt: skip
    store.standards.add_certificate(label, new)
    return one_standard(store, label, at.date())


def _point(request: CertifiedPointRequest) -> CertifiedPoint:
    value = request.value if request.correction is None else -request.correction
    if request.u is not None:
        return CertifiedPoint(request.nominal, value, request.u, 1.0)
    return CertifiedPoint(request.nominal, value, (request.expanded or 0.0) / request.k, request.k)


def add_check(store: Store, label: str, request: StandardCheckRequest, at: datetime) -> StandardResponse:
    """Enter an intermediate check. Raises NotFound, BadInput for a time to come."""
    checked_at = request.checked_at or at
    if checked_at > at:
        raise BadInput(f"checked_at {checked_at:%Y-%m-%d %H:%M} is a time to come; correct it")
    new = StandardCheck(checked_at, request.nominal, request.value, request.u, request.note, request.by, at)
    store.standards.add_check(label, new)
    return one_standard(store, label, at.date())


def mark_bad(store: Store, label: str, request: StandardBadRequest, at: datetime) -> StandardResponse:
    """Enter that a standard was found bad. Raises NotFound, BadInput for a first day to come."""
    if request.bad_from > at.date():
        raise BadInput(f"bad_from {request.bad_from} is a day to come; give the first day on which it was bad")
    new = StandardFinding(0, "bad", None, request.bad_from, request.bad_until, request.reason, request.by, at)
    store.standards.add_finding(label, new)
    return one_standard(store, label, at.date())


def withdraw_finding(
    store: Store, label: str, number: int, request: WithdrawFindingRequest, at: datetime
) -> StandardResponse:
    """Withdraw a finding. Raises NotFound for one that is not there, or is withdrawn."""
    standard = store.standards.get(label)
    if number not in {each.id for each in standard.bad}:
        raise NotFound(
            f"standard {standard.row.label} has no finding {number} in force; `labctl standards show "
            f"{standard.row.label}` lists its findings"
        )
    store.standards.add_finding(
        label, StandardFinding(0, "withdraw", number, None, None, request.reason, request.by, at)
    )  # fmt: skip
    return one_standard(store, label, at.date())


def list_standards(store: Store, on: date) -> list[StandardResponse]:
    """Return every standard, by label, as it is on a day."""
    return [answer_of(each, on) for each in store.standards.all()]


def count_by_state(store: Store, on: date) -> dict[str, int]:
    """Return how many standards are in each state on a day; every state has a number."""
    counts: dict[str, int] = dict.fromkeys(get_args(StandardState), 0)
    for each in store.standards.all():
        counts[answer_of(each, on).state] += 1
    return counts


def one_standard(store: Store, label: str, on: date) -> StandardResponse:
    """Return a standard by label or serial number as it is on a day. Raises NotFound."""
    return answer_of(store.standards.get(label), on)


def answer_of(standard: RegisteredStandard, on: date) -> StandardResponse:
    """Return a standard as an answer."""
    row = standard.row
    states = dict(_states(standard, on))
    state: StandardState = min(states, key=WORST_FIRST.index) if states else "valid"
    withdrawn = {each.finding: each for each in standard.findings if each.act == "withdraw"}
    return StandardResponse(
        label=row.label, serial=row.serial, quantity=row.quantity, unit=row.unit, description=row.description,
        state=state, text=[text for texts in states.values() for text in texts],
        due=due_of(standard),
        certificates=[_certificate(each) for each in standard.in_force],
        predictions=[prediction_answer(nominal, each) for nominal, each in predictions_of(standard, on)],
        checks=[check_answer(check, judged) for check, judged in charted(standard)],
        findings=[
            _finding(each, withdrawn.get(each.id)) for each in standard.findings if each.act == "bad"
        ],
    )  # fmt: skip


def due_of(standard: RegisteredStandard) -> date | None:
    """Return the last day on which a standard may be used: that of its newest certificate; None: none is stated."""
    return standard.in_force[-1].due if standard.in_force else None


def _states(standard: RegisteredStandard, on: date) -> Iterator[tuple[StandardState, list[str]]]:
    """Yield each state that a standard is in, beside `valid`, with its sentences."""
    label = standard.row.label
    now = [each for each in standard.bad if each.bad_until is None or each.bad_until >= on]
    if now:
        yield "bad", [f"{finding_text(standard, each)}; do not use it." for each in now]
    if out := list(to_be_checked(standard)):
        yield (
            "check it",
            [
                f"Check standard {label}: on {check.checked_at:%Y-%m-%d} its check of "
                f"{out_text(check.value, standard.row.unit, judged)}. Repeat the check or have the standard "
                "calibrated; if it is bad, say so with `labctl standards bad`."
                for check, judged in out
            ],
        )
    due = due_of(standard)
    if due is not None and due < on:
        yield "overdue", [f"Standard {label} was due on {due}, {(on - due).days} days ago; have it calibrated."]
    if not standard.certificates:
        yield "no certificate", [f"Standard {label} has no certificate; add it with `labctl standards certificate`."]


def _certificate(certificate: StandardCertificate) -> StandardCertificateResponse:
    return StandardCertificateResponse(
        number=certificate.number, laboratory=certificate.laboratory, calibrated=certificate.calibrated,
        due=certificate.due, adjusted=certificate.adjusted, traceability=certificate.traceability,
        reason=certificate.reason, by=certificate.by, at=certificate.at,
        points=[
            CertifiedPointResponse(nominal=each.nominal, value=each.value, u=each.u, k=each.k)
            for each in certificate.points
        ],
    )  # fmt: skip


def _finding(finding: StandardFinding, withdrawn: StandardFinding | None) -> StandardFindingResponse:
    if finding.bad_from is None:
        raise BadInput(f"finding {finding.id} has no first day; check the database with `labctl check`")
    withdrawal = "" if withdrawn is None else f"{withdrawn.by}, {withdrawn.at:%Y-%m-%d}: {withdrawn.reason}"
    return StandardFindingResponse(
        number=finding.id, bad_from=finding.bad_from, bad_until=finding.bad_until, reason=finding.reason, by=finding.by,
        at=finding.at, withdrawn=withdrawal,
    )  # fmt: skip
