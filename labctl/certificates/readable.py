"""A certificate as its pages show it: numbers rounded by the GUM, units and names as a person reads them."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from decimal import Decimal

from instruments.laboratory import Contact
from labctl.certificates.document import (
    AnyAxisResult,
    Certificate,
    CoefficientResult,
    ConformityResult,
    ResultPoint,
    SensorCoefficient,
    SensorReference,
    SensorResult,
    StandardUsed,
    StateOfItem,
)
from labctl.certificates.units import raised, readable
from labctl.probability_text import risk_text
from labctl.shown_unit import shown_unit

#: Digits of an uncertainty (GUM 7.2.6), and of a number without one.
U_DIGITS, DIGITS = 2, 4
#: Coefficients below ten to this power are written with a power of ten.
MIN_POWER = -4
PLACES = {
    "laboratory": "at the laboratory",
    "customer": "at the customer",
    "laboratoryBranch": "at a branch of the laboratory",
    "customerBranch": "at a branch of the customer",
    "other": "at another place",
}
MINUS = "−"
#: A place where a line may end: a zero-width space; and a piece of a word that is followed by more of it.
BREAK = "\u200b"
_LONG_WORD = re.compile(r"\S{30}(?=\S)")
#: Marks a standard uncertainty without the standards of the bench.
FIT_ALONE = " *"


def readable_certificate(certificate: Certificate) -> bytes:
    """Return what the template prints, as JSON."""
    return json.dumps(_pages(certificate), ensure_ascii=False, sort_keys=True).encode()


def _pages(record: Certificate) -> dict[str, object]:
    return {
        "title": record.title,
        "number": record.number,
        "version": record.calibration.version,
        "laboratory": _address(record.laboratory),
        "laboratory_name": record.laboratory.name,
        "specimen": next((text for text in record.statements if text.startswith("SPECIMEN")), ""),
        "facts": _facts(record),
        "issued": record.issued_on.isoformat(),
        "issued_by": _issuer(record),
        "authorised": _breakable(f"{record.authorised.persons}, {record.authorised.at:%Y-%m-%d %H:%M} UTC"),
        "authorised_name": record.authorised.name,
        "signature": _signature(record),
        "method": _method(record),
        "plan_hash": record.method.plan_hash or "",
        "environment": [
            [each.name, _signed(f"{each.low:.2f}"), _signed(f"{each.high:.2f}"), each.unit]
            for each in record.environment
        ],
        "standards": [_standard(standard) for standard in record.standards],
        "uncertainty": uncertainty_text(record),
        "budget": [
            [
                each.source.replace("_", " "),
                each.type,
                f"{Decimal(f'{each.contribution_dps:#.2g}'):f}",
                _freedom(each.freedom),
            ]
            for each in record.uncertainty.budget
        ],
        "results": _results(record.results),
        "any_axis": [_any_axis(each) for each in record.any_axis],
        "any_axis_text": _any_axis_text(record),
        "states": [
            _state("As found, before adjustment", record.as_found),
            _state("As left, after adjustment", record.as_left),
        ],
        "adjustment": record.adjustment,
        "coefficients": [_coefficient(coefficient) for coefficient in record.coefficients],
        "sensors": [_sensor(sensor) for sensor in record.sensors],
        "conformity": _conformity(record),
        "external": record.external,
        "due": record.due.isoformat() if record.due else "",
        "statements": [text for text in record.statements if not text.startswith("SPECIMEN")],
        "hash": record.calibration.hash,
        "address": record.calibration.address,
        "page": record.state_address,
        "manifests": [[f"Manifest {seal.manifest}, {seal.record}", seal.hash] for seal in record.manifests],
    }


def _issuer(record: Certificate) -> str:
    identity = f" ({record.issued_by_identity})" if record.issued_by_identity else ""
    return _breakable(record.issued_by + identity)


def _breakable(text: str) -> str:
    """Return a text in which a word that is longer than a column may be broken, so that it prints over no other."""
    return _LONG_WORD.sub(lambda part: part[0] + BREAK, text)


def _signature(certificate: Certificate) -> str:
    """Return the note below the names: how the certificate is valid, and who signed the file."""
    recorded = "The authorisation is recorded electronically in the audit trail of the laboratory;"
    signer = certificate.signed_by
    if signer is None:
        return f"{recorded} the certificate is valid without a signature by hand."
    return (
        f"{recorded} this file and the attached dcc.xml are signed electronically by {signer.subject} (certificate "
        f"SHA-256 {signer.fingerprint[:16]}…)."
    )


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.2g}{'' if unit == 'deg' else ' '}{readable(unit)}"


def _standard(standard: StandardUsed) -> list[str]:
    dates = [each.isoformat() if each else "–" for each in (standard.calibrated, standard.due)]
    cells = [each or "–" for each in (standard.certificate, standard.issued_by)]
    return [
        _standard_name(standard),
        _with_unit(standard.u, standard.unit),
        *cells,
        *dates,
        standard.traceability or "–",
    ]


def _standard_name(standard: StandardUsed) -> str:
    quantity = standard.quantity.replace("_", " ")
    return f"{quantity}: {standard.name}" if standard.name else quantity


def rounded(value: float, expanded: float) -> tuple[str, str]:
    """Return a value and its expanded uncertainty: U to two digits, rounded up; the value to the same place."""
    if not expanded > 0 or not math.isfinite(expanded):
        return _number(value), "–"
    place = U_DIGITS - 1 - math.floor(math.log10(expanded))
    u = math.ceil(expanded * 10.0**place * (1 - 1e-9)) / 10.0**place
    decimals = max(place, 0)
    return _signed(f"{round(value, place):.{decimals}f}"), f"{u:.{decimals}f}"


def _with_power(value: float, u: float) -> tuple[str, str]:
    """Return the same as `rounded`, small numbers with a power of ten that both have: 7.660 × 10⁻⁶, 0.056 × 10⁻⁶."""
    largest = max(abs(value), u)
    exponent = math.floor(math.log10(largest)) if largest > 0.0 else 0
    if exponent >= MIN_POWER:
        return rounded(value, u)
    shown, shown_u = rounded(value / 10.0**exponent, u / 10.0**exponent)
    power = raised(f" × 10^{exponent}")
    return shown + power, shown_u if shown_u == "–" else shown_u + power


def _number(value: float) -> str:
    return _signed(f"{value:.{DIGITS}g}")


def _signed(text: str) -> str:
    zero = not text.strip("-0.")
    return text.lstrip("-") if zero else text.replace("-", MINUS)


def _address(person: Contact) -> list[str]:
    lines = [person.name, person.street, f"{person.post_code} {person.city}, {person.country}"]
    return [line for line in (*lines, person.email, person.phone) if line.strip()]


def _facts(certificate: Certificate) -> list[list[object]]:
    customer, item = certificate.customer, certificate.item
    first, last = certificate.performed_from.isoformat(), certificate.performed_until.isoformat()
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
        ["Place of calibration", [_place(certificate)]],
        ["Date of issue", [certificate.issued_on.isoformat()]],
    ]
    if certificate.laboratory.accreditation:
        rows.insert(0, ["Accreditation", [certificate.laboratory.accreditation]])
    if certificate.replaces is not None:
        rows.insert(
            0, ["Replaces", [f"certificate {certificate.replaces.number}. Reason: {certificate.replaces.reason}"]]
        )
    kept = [[name, [line for line in lines if line]] for name, lines in rows if isinstance(lines, list)]
    return [[name, lines] for name, lines in kept if lines]


def _place(certificate: Certificate) -> str:
    place_name = PLACES[certificate.laboratory.place]
    return (
        f"{place_name}, {certificate.laboratory.city}" if certificate.laboratory.place == "laboratory" else place_name
    )


def _method(certificate: Certificate) -> list[list[str]]:
    method = certificate.method
    several = "s" if len(method.recordings) > 1 else ""
    rows = [
        ["Method", method.name],
        ["Procedure", method.procedure],
        ["Error model", f"{method.model}: {', '.join(method.effects)}"],
        ["Nominal scale factor", nominal_of(certificate)],
        [f"Recording{several}", ", ".join(map(str, method.recordings))],
        ["Software", method.software],
        ["Additions to, deviations or exclusions from the method", method.deviations],
        ["Results of external providers", certificate.external],
    ]
    return [row for row in rows if row[1]]


def nominal_of(certificate: Certificate) -> str:
    """Return the nominal line of each axis; empty for a certificate that was issued before it was stated."""
    return "; ".join(_signed(readable(each.text)) for each in certificate.nominal)


def uncertainty_text(certificate: Certificate) -> str:
    """Return how the expanded uncertainties are to be read."""
    uncertainty = certificate.uncertainty
    temperature_text = "" if uncertainty.temperature_c is None else f" and {_number(uncertainty.temperature_c)} °C"
    return (
        "The expanded uncertainty U is that of a corrected rate: the standard uncertainty times the coverage factor k "
        f"that is stated with each result, for a coverage of about {uncertainty.coverage_probability * 100:.0f} % "
        "(JCGM 100:2008). The standard uncertainty is made of the contributions below, here at the place where U is "
        f"largest: axis {uncertainty.axis}, {_number(uncertainty.rate_dps)} °/s{temperature_text}."
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


def _any_axis(result: AnyAxisResult) -> list[str]:
    across = f"about {' and '.join(result.across)}: {_expanded(result.per_dps_across)}" if result.across else MINUS
    return [result.output, _expanded(result.expanded_dps), _expanded(result.aligned_expanded_dps), across]


def _expanded(value: float | None) -> str:
    """Return an expanded uncertainty with two digits, rounded up."""
    return "not known" if value is None else rounded(0.0, value)[1]


def _any_axis_text(certificate: Certificate) -> str:
    if not certificate.any_axis:
        return ""
    reach = max(each.reach_dps for each in certificate.any_axis)
    unknown = "; ".join(dict.fromkeys(each.why for each in certificate.any_axis if each.why))
    return (
        "U in the results is that of a rotation about the axis of one output, the others at rest. Where the item turns "
        f"about any axis, at up to {_number(reach)} °/s, the angles of the mountings count as well: the largest U is "
        "given below, in the frame of the case, and up to a rotation of this frame, for an item whose axes are aligned "
        f"in use.{f' Not known: {unknown}.' if unknown else ''}"
    )


def _coefficient(coefficient: CoefficientResult) -> list[str]:
    factor, unit = shown_unit(coefficient.unit, coefficient.name)
    value, u = _with_power(factor * coefficient.value, factor * (coefficient.u or 0.0))
    temperature_text = "" if coefficient.temperature_c is None else _number(coefficient.temperature_c)
    of_fit = "" if coefficient.has_standards or u == "–" else FIT_ALONE
    return [coefficient.axis, coefficient.name_text, temperature_text, value, u + of_fit, readable(unit)]


def _sensor(result: SensorResult) -> Mapping[str, object]:
    """Return the section of an accelerometer or magnetometer."""
    first, last = result.performed_from.isoformat(), result.performed_until.isoformat()
    return {
        "title": f"{result.sensor.capitalize()}, version {result.version}",
        "facts": [
            ["Verdict", result.verdict],
            ["Findings", " ".join(result.found)],
            ["Reference", reference_text(result.reference)],
            ["Holds for", f"{result.holds_for} {result.not_stated}"],
            ["Measured", first if first == last else f"{first} to {last}"],
            ["Included by", result.included_by],
            ["Files, SHA-256", "; ".join(result.files)],
            ["SHA-256 of the result", result.hash],
        ],
        "formula": result.formula,
        "rows": [_of_sensor(coefficient) for coefficient in result.coefficients],
    }


def _of_sensor(coefficient: SensorCoefficient) -> list[str]:
    factor, unit = shown_unit(coefficient.unit, coefficient.name)
    value, expanded = rounded(factor * coefficient.value, factor * coefficient.expanded)
    return [coefficient.name, value, expanded, f"{coefficient.k:.2f}", readable(unit)]


def reference_text(reference: SensorReference) -> str:
    """Return the quantity by which a sensor was calibrated, its uncertainty and traceability."""
    u = "" if reference.u is None else f", u = {reference.u:.2g} {readable(reference.unit)}"
    value = f"{reference.value:.7g} {readable(reference.unit)}"
    return f"{reference.quantity} {value}{u}. Traceability: {reference.traceability}"


def _state(title: str, state: StateOfItem) -> Mapping[str, object]:
    rows = [[each.axis, f"{each.rms_dps:#.3g}", f"{each.max_dps:#.3g}"] for each in state.axes]
    return {"title": title, "basis": state.basis, "datasets": state.datasets, "rows": rows}


def _conformity(certificate: Certificate) -> Mapping[str, object] | None:
    judged = certificate.conformity
    if judged is None:
        return None
    return {"specification": judged.specification, "statement": judged.statement, "outcome": _outcome(judged.passed),
            "results": [_verified(result) for result in judged.results]}  # fmt: skip


def _outcome(passed: bool) -> str:
    return "PASS" if passed else "FAIL"


def _verified(result: ConformityResult) -> list[str]:
    error, expanded = rounded(result.error_dps, result.expanded_dps)
    temperature_text = "–" if result.temperature_c is None else _number(result.temperature_c)
    rates = [_number(rate) for rate in result.rates_dps]
    return [result.output, temperature_text, *rates, error, expanded, risk_text(result.risk), _outcome(result.passed)]
