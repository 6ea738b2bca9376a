"""What a bench file states of its standards, compared with the register, and what a campaign records of them.

The bench file says what is mounted; the register says what is known of it. Where both state an uncertainty or a due
date, the less favourable one counts, and the difference is reported. A campaign records the result in the head of each
recording, which budget, certificate and exports read: there is one uncertainty of a standard, that of its day of use.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from datetime import date

from instruments.bench_config import BenchFile
from instruments.standards import MEASURED_STEP_CLOCK, Standard
from labctl.answers.benches import BenchCheckResponse, DeviceCheck, FindingResponse
from labctl.errors import Conflict, StoreError
from labctl.metrology.certificate_drift import Prediction
from labctl.services.benches.standards import CLOCK_SETTING, DEMANDED_RATE, standards_of
from labctl.services.standards.checks import to_be_checked
from labctl.services.standards.predictions import predictions_of
from labctl.services.standards.register import due_of
from labctl.services.standards.usage import (
    finding_text,
    is_entry_of,
    is_named,
    numbered,
    overlaps,
    same_issuer,
)
from labctl.store import RegisteredStandard, Store
from procedures.contracts.journal import Event

#: Two statements of one uncertainty differ from this share of it on: certificates are rounded to two digits.
ROUNDING = 0.01
DEVICE = "standards"
#: Names of the standards that settings of the table say: no register has them.
OF_SETTINGS = frozenset({"", MEASURED_STEP_CLOCK, CLOCK_SETTING, DEMANDED_RATE})


def matched(store: Store, standards: Sequence[Standard]) -> list[tuple[Standard, RegisteredStandard | None]]:
    """Return each entry of a bench file with its standard in the register; None: it is not there."""
    known = store.standards.all()
    return [(standard, _match(standard, known)) for standard in standards]


def _match(entry: Standard, known: Sequence[RegisteredStandard]) -> RegisteredStandard | None:
    """Return the standard that an entry names, else the one whose certificate it names."""
    matches = sorted((one for one in known if is_entry_of(one, entry)), key=lambda one: not is_named(one, entry))
    return next(iter(matches), None)


def as_used(store: Store, standards: Sequence[Standard], on: date) -> tuple[Standard, ...]:
    """Return the standards of a bench as a campaign of a day records them: with what the register predicts."""
    return tuple(each if known is None else _as_used(each, known, on) for each, known in matched(store, standards))


def _as_used(entry: Standard, known: RegisteredStandard, on: date) -> Standard:
    """Return an entry with the larger uncertainty, the known error of the day and the earlier due date."""
    due = min((day for day in (entry.due, due_of(known)) if day is not None), default=None)
    standard = entry if due == entry.due else entry.model_copy(update={"due": due})
    if not _is_comparable(entry, known):
        return standard
    predictions = [each for _, each in predictions_of(known, on)]
    u = max((prediction.u for prediction in predictions), default=0.0)
    changed: dict[str, object] = {}
    if u > entry.standard_u * (1 + ROUNDING):
        changed |= {"u": u, "expanded": None, "half_width": None, "distribution": "normal", "freedom": None}
    left = max(_left(entry, known, predictions), key=abs, default=entry.uncorrected)
    if abs(left - entry.uncorrected) > ROUNDING * max(u, entry.standard_u):
        changed |= {"value": left, "corrected": False}
    return standard.model_copy(update=changed) if changed else standard


def _left(entry: Standard, known: RegisteredStandard, predictions: Sequence[Prediction]) -> Iterator[float]:
    """Yield the predicted error at each nominal, less what the bench corrects its readings by."""
    certified = [point.value for point in known.in_force[-1].points]
    for prediction, stated in zip(predictions, certified, strict=True):
        if prediction.value is None:
            continue
        by_entry = entry.value is not None and len(certified) == 1
        applied = entry.value if by_entry else stated
        yield prediction.value - (applied or 0.0) * entry.corrected


def _is_comparable(entry: Standard, known: RegisteredStandard) -> bool:
    return (entry.quantity, entry.unit_name) == (known.row.quantity, known.row.unit) and bool(known.in_force)


def refuse_bad(store: Store, standards: Sequence[Standard], on: date, bench: str) -> None:
    """Raise Conflict where a standard of a bench is bad on a day: nothing that it measures could be certified."""
    findings_text = [
        finding_text(known, finding)
        for _, known in matched(store, standards)
        if known is not None
        for finding in known.bad
        if overlaps(on, on, finding.bad_from, finding.bad_until)
    ]
    if findings_text:
        raise Conflict(
            f"bench {bench}: {'; '.join(findings_text)}. Put another standard on the bench and into its bench file; a "
            "finding that was wrong is withdrawn by `labctl standards withdraw`"
        )


def differences(store: Store, standards: Sequence[Standard], on: date) -> Iterator[tuple[Standard, str]]:
    """Yield each entry of a bench that does not agree with the register, with the difference in words."""
    register = store.standards.all()
    for entry in standards:
        known = _match(entry, register)
        for text in _of_issuer(entry, register) if known is None else _differences(entry, known, on):
            yield entry, text


def _of_issuer(entry: Standard, register: Sequence[RegisteredStandard]) -> Iterator[str]:
    """Yield that a number is in the register by another laboratory, so that the entry is no standard of it."""
    for one in register:
        for certificate in numbered(one, entry):
            yield (
                f"certificate {entry.certificate} of {entry.issued_by} in the bench file is in the register as one of "
                f"{certificate.laboratory}, of standard {one.row.label}; they are taken for two certificates. If it is "
                "the same, write the same laboratory in both"
            )
            return


def _differences(entry: Standard, known: RegisteredStandard, on: date) -> Iterator[str]:
    label, due = known.row.label, due_of(known)
    if entry.due is not None and due is not None and entry.due != due:
        yield (
            f"standard {label}: due {entry.due} in the bench file, {due} in the register; the earlier date counts. "
            "Correct the one that is wrong"
        )
    elif entry.due is None and due is not None and due < on:
        yield f"standard {label}: was due on {due} by the register; have it calibrated"
    numbers = [each.number for each in known.in_force]
    issuers = [each.laboratory for each in numbered(known, entry)]
    if issuers and not any(same_issuer(issuer, entry.issued_by) for issuer in issuers):
        yield from _of_issuer(entry, [known])
    elif entry.certificate and numbers and entry.certificate not in numbers:
        yield (
            f"standard {label}: certificate {entry.certificate} of the bench file is not in the register, whose newest "
            f"is {numbers[-1]}; add it with `labctl standards certificate`, or correct the bench file"
        )
    elif entry.certificate and numbers and entry.certificate != numbers[-1]:
        yield (
            f"standard {label}: the bench file names certificate {entry.certificate}, but the register has the newer "
            f"{numbers[-1]}; correct the bench file"
        )
    yield from _of_uncertainty(entry, known, on)
    for check, _ in to_be_checked(known):
        yield (
            f"standard {label}: its check of {check.checked_at:%Y-%m-%d} is out of the control limits; repeat the "
            "check before the campaign (`labctl standards show`)"
        )


def _of_uncertainty(entry: Standard, known: RegisteredStandard, on: date) -> Iterator[str]:
    label, unit_symbol = known.row.label, entry.unit_name
    if (entry.quantity, unit_symbol) != (known.row.quantity, known.row.unit):
        yield (
            f"standard {label}: {entry.quantity} in {unit_symbol} in the bench file, {known.row.quantity} in "
            f"{known.row.unit} in the register; its uncertainty is not compared. Correct the one that is wrong"
        )
        return
    if not known.in_force:
        return
    stated = max(point.u for point in known.in_force[-1].points)
    if not math.isclose(stated, entry.standard_u, rel_tol=ROUNDING):
        yield (
            f"standard {label}: u = {entry.standard_u:.3g} {unit_symbol} in the bench file, {stated:.3g} {unit_symbol} "
            f"by certificate {known.in_force[-1].number} in the register; the larger one counts. Correct the "
            "one that is wrong"
        )
    used = _as_used(entry, known, on)
    if used.standard_u > max(stated, entry.standard_u) * (1 + ROUNDING):
        yield (
            f"standard {label}: u = {used.standard_u:.3g} {unit_symbol} on {on} with the uncertainty of its drift, "
            "which the campaign records and its budgets use; a new calibration of the standard makes it smaller"
        )


def register_events(store: Store, standards: Sequence[Standard], on: date) -> tuple[Event, ...]:
    """Return a warning for each entry of a bench that does not agree with the register."""
    return tuple(
        Event("standard_differs", text, level="warning", device=entry.quantity)
        for entry, text in differences(store, standards, on)
    )


def compared(
    answer: BenchCheckResponse, bench: BenchFile, opened: Callable[[], AbstractContextManager[Store | None]]
) -> BenchCheckResponse:
    """Return the check of a bench with what the register says of its standards, where there are both.

    `opened` opens the database, or gives None where there is none. A bench that states no standard needs none, and one
    that cannot be read is said: instruments answer without it.
    """
    if not any(each.certificate or each.name not in OF_SETTINGS for each in standards_of(bench)):
        return answer
    try:
        with opened() as store:
            return answer if store is None else with_register(store, answer, bench)
    except StoreError as error:
        return _without_register(answer, str(error))


def _without_register(answer: BenchCheckResponse, why: str) -> BenchCheckResponse:
    text = f"the register was not read, so the standards are not compared with it: {why}"
    finding = FindingResponse(what="register", text=text, state="doubtful")
    device = DeviceCheck(device=DEVICE, ok=True, text=text, state="doubtful", findings=[finding])
    return answer.model_copy(update={"devices": [*answer.devices, device]})


def with_register(store: Store, answer: BenchCheckResponse, bench: BenchFile) -> BenchCheckResponse:
    """Return the check of a bench with what the register says of its standards; a bad one is a failed check."""
    standards, on = standards_of(bench), answer.checked_at.date()
    known = [(entry, one) for entry, one in matched(store, standards) if one is not None]
    differences_text = [text for _, text in differences(store, standards, on)]
    if not known and not differences_text:
        return answer
    try:
        refuse_bad(store, standards, on, bench.name)
        bad = ""
    except Conflict as refused:
        bad = str(refused)
    findings = [FindingResponse(what="register", text=bad, state="bad")] if bad else []
    findings += [FindingResponse(what="register", text=text, state="doubtful") for text in differences_text]
    if not findings:
        labels = ", ".join(one.row.label for _, one in known)
        findings = [FindingResponse(what="register", text=f"agrees with the register: {labels}", state="good")]
    device = DeviceCheck(
        device=DEVICE, ok=not bad, text="; ".join(finding.text for finding in findings),
        state="bad" if bad else findings[0].state, findings=findings,
    )  # fmt: skip
    return answer.model_copy(update={"ok": answer.ok and not bad, "devices": [*answer.devices, device]})
