"""A certificate as its pages show it: numbers rounded by the GUM, units and names as a person reads them."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from decimal import Decimal

from instruments.laboratory import Contact
from labctl.certificates.document import (
    AnyAxisResult,
    Certificate,
    CoefficientResult,
    ConformityResult,
    ResultPoint,
    SensorReference,
    SensorResult,
    StandardUsed,
    StateOfItem,
)
from labctl.certificates.units import readable

#: Digits of an uncertainty (GUM 7.2.6), and of a number without one.
U_DIGITS, DIGITS = 2, 4
PLACES = {
    "laboratory": "at the laboratory",
    "customer": "at the customer",
    "laboratoryBranch": "at a branch of the laboratory",
    "customerBranch": "at a branch of the customer",
    "other": "at another place",
}
MINUS = "−"
#: A probability below this is written as a bound.
LEAST_RISK = 1e-4
#: Marks a standard uncertainty without the standards of the bench.
FIT_ALONE = " *"


def readable_certificate(given: Certificate) -> bytes:
    """Return what the template prints, as JSON."""
    return json.dumps(_pages(given), ensure_ascii=False, sort_keys=True).encode()


def _pages(given: Certificate) -> dict[str, object]:
    return {
        "title": given.title,
        "number": given.number,
        "version": given.calibration.version,
        "laboratory": _address(given.laboratory),
        "laboratory_name": given.laboratory.name,
        "specimen": next((text for text in given.statements if text.startswith("SPECIMEN")), ""),
        "facts": _facts(given),
        "issued": given.issued_on.isoformat(),
        "issued_by": given.issued_by + (f" ({given.issued_by_identity})" if given.issued_by_identity else ""),
        "authorised": f"{given.authorised.persons}, {given.authorised.at:%Y-%m-%d %H:%M} UTC",
        "authorised_name": given.authorised.name,
        "signature": _signature(given),
        "method": _method(given),
        "plan_hash": given.method.plan_hash or "",
        "environment": [
            [each.name, _signed(f"{each.low:.2f}"), _signed(f"{each.high:.2f}"), each.unit]
            for each in given.environment
        ],
        "standards": [_standard(standard) for standard in given.standards],
        "uncertainty": uncertainty_text(given),
        "budget": [
            [
                each.source.replace("_", " "),
                each.type,
                f"{Decimal(f'{each.contribution_dps:.2g}'):f}",
                _freedom(each.freedom),
            ]
            for each in given.uncertainty.budget
        ],
        "results": _results(given.results),
        "any_axis": [_any_axis(each) for each in given.any_axis],
        "any_axis_text": _any_axis_text(given),
        "states": [
            _state("As found, before adjustment", given.as_found),
            _state("As left, after adjustment", given.as_left),
        ],
        "adjustment": given.adjustment,
        "coefficients": [_coefficient(coefficient) for coefficient in given.coefficients],
        "sensors": [_sensor(sensor) for sensor in given.sensors],
        "conformity": _conformity(given),
        "external": given.external,
        "due": given.due.isoformat() if given.due else "",
        "statements": [text for text in given.statements if not text.startswith("SPECIMEN")],
        "hash": given.calibration.hash,
        "address": given.calibration.address,
        "page": given.state_address,
        "manifests": [
            [f"Manifest {manifest.manifest}, {manifest.record}", manifest.hash] for manifest in given.manifests
        ],
    }


def _signature(given: Certificate) -> str:
    """Return the note below the names: how the certificate is valid, and who signed the file."""
    recorded = "The authorisation is recorded electronically in the audit trail of the laboratory;"
    signer = given.signed_by
    if signer is None:
        return f"{recorded} the certificate is valid without a signature by hand."
    return (
        f"{recorded} this file and the attached dcc.xml are signed electronically by {signer.subject} (certificate "
        f"SHA-256 {signer.fingerprint[:16]}…)."
    )


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.2g}{'' if unit == 'deg' else ' '}{readable(unit)}"


def _standard(given: StandardUsed) -> list[str]:
    dates = [each.isoformat() if each else "–" for each in (given.calibrated, given.due)]
    said = [each or "–" for each in (given.certificate, given.issued_by)]
    return [_standard_name(given), _with_unit(given.u, given.unit), *said, *dates, given.traceability or "–"]


def _standard_name(given: StandardUsed) -> str:
    quantity = given.quantity.replace("_", " ")
    return f"{quantity}: {given.name}" if given.name else quantity


def rounded(value: float, expanded: float) -> tuple[str, str]:
    """Return a value and its expanded uncertainty: U to two digits, rounded up; the value to the same place."""
    if not expanded > 0 or not math.isfinite(expanded):
        return _number(value), "–"
    place = U_DIGITS - 1 - math.floor(math.log10(expanded))
    u = math.ceil(expanded * 10.0**place * (1 - 1e-9)) / 10.0**place
    decimals = max(place, 0)
    return _signed(f"{round(value, place):.{decimals}f}"), f"{u:.{decimals}f}"


def _number(value: float) -> str:
    return _signed(f"{value:.{DIGITS}g}")


def _signed(text: str) -> str:
    zero = not text.strip("-0.")
    return text.lstrip("-") if zero else text.replace("-", MINUS)


def _address(given: Contact) -> list[str]:
    lines = [given.name, given.street, f"{given.post_code} {given.city}, {given.country}"]
    return [line for line in (*lines, given.email, given.phone) if line.strip()]


def _facts(given: Certificate) -> list[list[object]]:
    customer, item = given.customer, given.item
    first, last = given.performed_from.isoformat(), given.performed_until.isoformat()
    rows: list[list[object]] = [
        ["Customer", [*_address(customer), f"Contact: {customer.contact}" if customer.contact else ""]],
        ["Order", [customer.order]],
        ["Item", [f"{item.description}, axes {', '.join(item.axes)}"]],
        ["Manufacturer and model", [f"{item.manufacturer}, {item.model}"]],
        ["Serial number", [item.serial]],
        ["Customer's number", [item.identification]],
        ["Condition on receipt", [item.condition]],
        ["Date of receipt", [item.received.isoformat() if item.received else "not critical to the results"]],
        ["Calibrated", [first if first == last else f"{first} to {last}"]],
        ["Place of calibration", [_place(given)]],
        ["Date of issue", [given.issued_on.isoformat()]],
    ]
    if given.laboratory.accreditation:
        rows.insert(0, ["Accreditation", [given.laboratory.accreditation]])
    if given.replaces is not None:
        rows.insert(0, ["Replaces", [f"certificate {given.replaces.number}. Reason: {given.replaces.reason}"]])
    kept = [[name, [line for line in lines if line]] for name, lines in rows if isinstance(lines, list)]
    return [[name, lines] for name, lines in kept if lines]


def _place(given: Certificate) -> str:
    where = PLACES[given.laboratory.place]
    return f"{where}, {given.laboratory.city}" if given.laboratory.place == "laboratory" else where


def _method(given: Certificate) -> list[list[str]]:
    method = given.method
    several = "s" if len(method.recordings) > 1 else ""
    rows = [
        ["Method", method.name],
        ["Procedure", method.procedure],
        ["Error model", f"{method.model}: {', '.join(method.effects)}"],
        [f"Recording{several}", ", ".join(map(str, method.recordings))],
        ["Software", method.software],
        ["Additions to, deviations or exclusions from the method", method.deviations],
        ["Results of external providers", given.external],
    ]
    return [row for row in rows if row[1]]


def uncertainty_text(given: Certificate) -> str:
    """Return how the expanded uncertainties are to be read."""
    uncertainty = given.uncertainty
    warm = "" if uncertainty.temperature_c is None else f" and {_number(uncertainty.temperature_c)} °C"
    return (
        "The expanded uncertainty U is that of a corrected rate: the standard uncertainty times the coverage factor k "
        f"that is stated with each result, for a coverage of about {uncertainty.coverage_probability * 100:.0f} % "
        "(JCGM 100:2008). The standard uncertainty is made of the contributions below, here at the place where U is "
        f"largest: axis {uncertainty.axis}, {_number(uncertainty.rate_dps)} °/s{warm}."
    )


def _freedom(freedom: float | None) -> str:
    return "∞" if freedom is None else f"{freedom:.0f}"


def _results(points: Sequence[ResultPoint]) -> list[Mapping[str, object]]:
    """Return one table for each axis, a row for each temperature and rate."""
    return [
        {
            "axis": axis,
            "rows": [
                [
                    "–" if point.temperature_c is None else _number(point.temperature_c),
                    _number(point.rate_dps),
                    *rounded(point.error_dps, point.expanded_dps),
                    f"{point.k:.2f}",
                ]
                for point in points
                if point.axis == axis
            ],
        }
        for axis in dict.fromkeys(point.axis for point in points)
    ]


def _any_axis(given: AnyAxisResult) -> list[str]:
    across = f"about {' and '.join(given.across)}: {_expanded(given.per_dps_across)}" if given.across else MINUS
    return [given.output, _expanded(given.expanded_dps), _expanded(given.aligned_expanded_dps), across]


def _expanded(value: float | None) -> str:
    """Return an expanded uncertainty with two digits, rounded up."""
    return "not known" if value is None else rounded(0.0, value)[1]


def _any_axis_text(given: Certificate) -> str:
    if not given.any_axis:
        return ""
    reach = max(each.reach_dps for each in given.any_axis)
    unknown = "; ".join(dict.fromkeys(each.why for each in given.any_axis if each.why))
    return (
        "U in the results is that of a rotation about the axis of one output, the others at rest. Where the item turns "
        f"about any axis, at up to {_number(reach)} °/s, the angles of the mountings count as well: the largest U is "
        "given below, in the frame of the case, and up to a rotation of this frame, for an item whose axes are aligned "
        f"in use.{f' Not known: {unknown}.' if unknown else ''}"
    )


def _coefficient(given: CoefficientResult) -> list[str]:
    value, u = rounded(given.value, given.u or 0.0)
    warm = "" if given.temperature_c is None else _number(given.temperature_c)
    of_fit = "" if given.has_standards or u == "–" else FIT_ALONE
    return [given.axis, given.name_text, warm, value, u + of_fit, readable(given.unit)]


def _sensor(given: SensorResult) -> Mapping[str, object]:
    """Return the section of an accelerometer or magnetometer."""
    first, last = given.performed_from.isoformat(), given.performed_until.isoformat()
    return {
        "title": f"{given.sensor.capitalize()}, version {given.version}",
        "facts": [
            ["Verdict", given.verdict],
            ["Findings", " ".join(given.found)],
            ["Reference", reference_text(given.reference)],
            ["Holds for", f"{given.holds_for} {given.not_stated}"],
            ["Measured", first if first == last else f"{first} to {last}"],
            ["Included by", given.included_by],
            ["Files, SHA-256", "; ".join(given.files)],
            ["SHA-256 of the result", given.hash],
        ],
        "formula": given.formula,
        "rows": [
            [
                coefficient.name,
                *rounded(coefficient.value, coefficient.expanded),
                f"{coefficient.k:.2f}",
                readable(coefficient.unit),
            ]
            for coefficient in given.coefficients
        ],
    }


def reference_text(given: SensorReference) -> str:
    """Return the quantity by which a sensor was calibrated, its uncertainty and traceability."""
    u = "" if given.u is None else f", u = {given.u:.2g} {readable(given.unit)}"
    return f"{given.quantity} {given.value:.7g} {readable(given.unit)}{u}. Traceability: {given.traceability}"


def _state(title: str, given: StateOfItem) -> Mapping[str, object]:
    rows = [[each.axis, f"{each.rms_dps:#.3g}", f"{each.max_dps:#.3g}"] for each in given.axes]
    return {"title": title, "basis": given.basis, "datasets": given.datasets, "rows": rows}


def _conformity(given: Certificate) -> Mapping[str, object] | None:
    judged = given.conformity
    if judged is None:
        return None
    return {"specification": judged.specification, "statement": judged.statement, "outcome": _outcome(judged.passed),
            "results": [_verified(result) for result in judged.results]}  # fmt: skip


def percent(probability: float) -> str:
    """Return a probability in percent, to two digits; one that is too small to matter as a bound."""
    if probability < LEAST_RISK:
        return f"below {100.0 * LEAST_RISK:g} %"
    return f"{100.0 * probability:.2g} %" if probability < 0.99 else "above 99 %"


def _outcome(passed: bool) -> str:
    return "PASS" if passed else "FAIL"


def _verified(given: ConformityResult) -> list[str]:
    error, expanded = rounded(given.error_dps, given.expanded_dps)
    warm = "–" if given.temperature_c is None else _number(given.temperature_c)
    rates = [_number(rate) for rate in given.rates_dps]
    return [given.output, warm, *rates, error, expanded, percent(given.risk), _outcome(given.passed)]
