"""Issue of a certificate: refused, or made in its three forms, signed and recorded; asked again, the same bytes."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date, datetime, timedelta

from instruments.standards import Standard
from labctl.acting_user import acting_key
from labctl.answers.certificates import (
    CertificateOrder,
    CertificateRequest,
    CertificateResponse,
    MissingFactResponse,
    WithdrawRequest,
)
from labctl.answers.json_object import JsonObject
from labctl.certificates.document import hash_of_certificate
from labctl.config import SIGN_KEY_VARIABLE
from labctl.errors import Conflict
from labctl.services.calibrations.release import needs_second_person
from labctl.services.certificates.assembly import assembled
from labctl.services.certificates.facts import Facts, facts_of
from labctl.services.certificates.found import Found
from labctl.services.certificates.missing import MissingFacts
from labctl.services.certificates.signature import forms_of, signing_key, to_be_signed
from labctl.services.certificates.states import certificate_by_number
from labctl.services.standards.usage import Notices
from labctl.store import CertificateRow, Store, Withdrawal

#: An item comes at most so long before it is measured, ten years: an earlier date is a slip, such as 1900-01-01.
MAX_BEFORE_MEASUREMENT = timedelta(days=3653)


class CertificateRefused(Conflict):
    """A certificate may not be issued; the text says why, and what to do."""

    slug = "certificate-refused"

    def __init__(self, text: str, errors: Sequence[JsonObject] = ()) -> None:
        super().__init__(text)
        self.errors = list(errors)  #: what is wrong with keys of the order, as errors of requests say it

    @classmethod
    def of_key(cls, table: str, key: str, words: str) -> CertificateRefused:
        """Return the refusal of what a key of the order states; `words` begin with its value."""
        place: JsonObject = {"place": ["body", "order", table, key], "text": words}
        return cls(f"[{table}] of the order: {key} = {words}", [place])

    @property
    def members(self) -> JsonObject:
        """What is wrong with keys of the order, each with its place in the request."""
        return {"errors": [*self.errors]} if self.errors else {}


def issue(store: Store, serial: str, version: int, request: CertificateRequest, at: datetime) -> CertificateResponse:
    """Issue the certificate of a version at an aware time; one that was issued is answered as it is.

    Raises NotFound, MissingFacts, CertificateRefused, Conflict where other facts are given for one that was issued and
    where a standard was found bad while it was being written, BadInput for a signing key that cannot be used.
    """
    newest = store.certificates.newest(store.units.get(serial).serial, version)
    if newest is not None and request.amend is None:
        return certificate_by_number(store, _unchanged(newest, request).number)
    if newest is None and request.amend is not None:
        raise CertificateRefused(f"{serial} version {version} has no certificate to amend; issue one without --amend")
    order = CertificateOrder.model_validate(newest.order) if newest and not _given(request) else request.order
    last = store.standards.last_finding()  # before the evidence is read: a later one is found when it is stored
    facts = facts_of(store, serial, version, order)
    evidence = Found.of(store, facts)
    refuse(facts, evidence)
    _refuse_bad(store, facts)
    with signing_key(at) as key:
        if newest is not None and newest.signed_by is not None and key is None:
            raise CertificateRefused(
                f"certificate {newest.number} is signed, and no key is set to sign the one that replaces it; name the "
                f"key by {SIGN_KEY_VARIABLE}"
            )
        certificate = to_be_signed(assembled(store, facts, evidence, request, at, newest), key)
        forms = forms_of(certificate, key, at)
    row = CertificateRow(
        certificate.number, serial, version, newest.number if newest else None, request.amend or "", request.by, at,
        hash_of_certificate(forms.document), order.model_dump(mode="json", exclude_defaults=True), acting_key(),
        signed_by=None if certificate.signed_by is None else certificate.signed_by.model_dump(mode="json"),
    )  # fmt: skip
    return certificate_by_number(store, store.certificates.add(row, forms, last).number)


def missing_facts(store: Store, serial: str, version: int) -> list[MissingFactResponse]:
    """Return the mandatory facts of a certificate that a version, its readings and an empty order do not state.

    Raises NotFound; BadInput, NotEnoughData, NotConverged where the results of the version cannot be computed.
    """
    facts = facts_of(store, serial, version, CertificateOrder())
    found = Found.of(store, facts)
    return [MissingFactResponse.model_validate(each._asdict()) for each in (*facts.missing(), *found.missing())]


def withdraw(store: Store, request: WithdrawRequest, at: datetime) -> CertificateResponse:
    """Withdraw a certificate at an aware time; its forms stay as they were issued. Raises NotFound, Conflict."""
    store.certificates.withdraw(request.number, Withdrawal(request.by, acting_key(), request.reason, at))
    return certificate_by_number(store, request.number)


def _given(request: CertificateRequest) -> dict[str, object]:
    """Return the facts that a request states."""
    return request.order.model_dump(mode="json", exclude_defaults=True)


def _unchanged(kept: CertificateRow, request: CertificateRequest) -> CertificateRow:
    """Return what was issued; raises Conflict where the request states other facts of the order."""
    given_facts = _given(request)
    if given_facts and kept.withdrawal is not None:
        gone = kept.withdrawal
        raise CertificateRefused(
            f"certificate {kept.number} of {kept.serial} version {kept.version} was withdrawn at "
            f"{gone.at:%Y-%m-%d %H:%M} UTC by {gone.by} ({gone.reason}); to issue a new certificate in its place, give "
            "the reason with --amend REASON (over HTTP: `amend`)"
        )
    if given_facts and given_facts != kept.order:
        other = ", ".join(
            sorted(name for name in {*given_facts, *kept.order} if given_facts.get(name) != kept.order.get(name))
        )
        raise CertificateRefused(
            f"certificate {kept.number} of {kept.serial} version {kept.version} was issued with another "
            f"{other}; to replace that certificate, give the reason with --amend REASON (over HTTP: `amend`)"
        )
    return kept


def refuse(facts: Facts, evidence: Found) -> None:
    """Raise MissingFacts, or CertificateRefused for a version that was revoked, or certified by one person where two
    are needed, and for a standard outside its dates."""
    if missing := [*facts.missing(), *evidence.missing()]:
        raise MissingFacts.of(facts.what, missing)
    act = facts.authorised
    if act is not None and act.act == "revoke":
        raise CertificateRefused(
            f"{facts.what} was revoked at {act.at:%Y-%m-%d %H:%M} UTC by {act.by} ({act.reason}); certify "
            "another version, and issue the certificate of that version"
        )
    if act is not None and act.release is None and needs_second_person():
        raise CertificateRefused(
            f"{facts.what} was certified by {act.by} alone, at {act.at:%Y-%m-%d %H:%M} UTC, and two persons have to "
            f"certify a version here; certify it again, and have it released (`labctl release`)"
        )
    _refuse_dates(facts)


def _refuse_dates(facts: Facts) -> None:
    """Raise CertificateRefused for days that cannot be, and for a standard that was not calibrated then."""
    first, last = facts.performed_from, facts.performed_until
    if first is None or last is None:
        return
    if last < first:
        words = f"{last} is before the first day of the measurements of {facts.what}, {first}; correct the dates"
        raise CertificateRefused.of_key("method", "performed_until", words)
    _refuse_receipt(facts, first)
    if bad := [standard for standard in facts.standards if _off(standard, first, last)]:
        text = "; ".join(f"{each.label}: calibrated {each.calibrated or 'not stated'}, due {each.due}" for each in bad)
        raise CertificateRefused(
            f"no certificate of {facts.what}: measured from {first} to {last}, when the calibration of a "
            f"reference standard was not valid ({text}). Have the standard calibrated, and measure again"
        )


def _refuse_receipt(facts: Facts, first: date) -> None:
    """Raise CertificateRefused for an item that came after its first day of measurement, or long before."""
    received = facts.order.item.received
    if received is not None and received > first:
        words = f"{received} is after the calibration of {facts.what} began, {first}; correct the date"
        raise CertificateRefused.of_key("item", "received", words)
    if received is not None and first - received > MAX_BEFORE_MEASUREMENT:
        words = f"{received} is more than 10 years before the calibration of {facts.what} began, {first}"
        raise CertificateRefused.of_key("item", "received", f"{words}; correct the date")


def _refuse_bad(store: Store, facts: Facts) -> None:
    """Raise CertificateRefused for measurements with a standard that was found bad on those days."""
    if bad := Notices.of(store).of_recordings([row.id for row in facts.recordings]):
        raise CertificateRefused(
            f"no certificate of {facts.what}: {'; '.join(bad)}, and the calibration was measured with it from "
            f"{facts.performed_from} to {facts.performed_until}. Measure again with another standard; a finding that "
            "was wrong is withdrawn by `labctl standards withdraw`"
        )


def _off(standard: Standard, first: date, last: date) -> bool:
    return standard.is_overdue(last) or (standard.calibrated is not None and standard.calibrated > first)
