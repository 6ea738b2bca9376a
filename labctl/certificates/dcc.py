"""A certificate as Digital Calibration Certificate: XML by the schema 3.3.0 of PTB, the same bytes every time."""

from __future__ import annotations

from itertools import groupby
from xml.etree import ElementTree as ET

from labctl.certificates.document import Certificate, Condition, Conformity, SensorResult, StandardUsed, StateOfItem
from labctl.certificates.readable import nominal_of, reference_text, uncertainty_text
from labctl.certificates.units import readable
from labctl.certificates.xml_parts import DCC, ENGLISH, SI, child, contact, optional, quantity, referred, texts

VERSION = "3.3.0"
XSI = "http://www.w3.org/2001/XMLSchema-instance"
#: Identifiers of statements and results: what the documentation of certificates refers to.
STATED = "https://ptb.de/dcc"
#: Where PTB defines the refTypes with the prefix basic_; docs/reference/certificate.md says where each one is.
REF_TYPES = "https://digilab.ptb.de/dkd/refType/vocab/index.php?tema=2"
#: Conditions for which PTB has a refType, with one for the least and one for the largest value.
CONDITIONS = {
    "Temperature of the chamber air": "basic_temperature",
    "Relative humidity of the air": "basic_humidityRelative",
}


def dcc_of(certificate: Certificate) -> bytes:
    """Return the XML of a certificate."""
    for prefix, space in (("dcc", DCC), ("si", SI), ("xsi", XSI)):
        ET.register_namespace(prefix, space)
    root = ET.Element(f"{{{DCC}}}digitalCalibrationCertificate", {"schemaVersion": VERSION})
    root.set(f"{{{XSI}}}schemaLocation", f"{STATED} {STATED}/v{VERSION}/dcc.xsd")
    _administrative(child(root, "administrativeData"), certificate)
    _measured(child(root, "measurementResults"), certificate)
    ET.indent(root, " ")
    return ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n"


def _administrative(parent: ET.Element, certificate: Certificate) -> None:
    _software(child(parent, "dccSoftware"), certificate.method.software)
    defined = child(child(parent, "refTypeDefinitions"), "refTypeDefinition")
    texts(defined, "name", "Namespace of refTypes that several communities share")
    child(defined, "namespace", "basic")
    child(defined, "link", REF_TYPES)
    _core(child(parent, "coreData"), certificate)
    _item(child(parent, "items"), certificate)
    laboratory = child(parent, "calibrationLaboratory")
    optional(laboratory, "calibrationLaboratoryCode", certificate.laboratory.accreditation)
    contact(laboratory, "contact", certificate.laboratory)
    people = child(parent, "respPersons")
    _person(people, certificate.authorised.name, "authorised the results", signs=True)
    if certificate.issued_by != certificate.authorised.name:
        _person(people, certificate.issued_by, "issued the certificate", signs=False)
    reached = f"Contact: {certificate.customer.contact}" if certificate.customer.contact else ""
    contact(parent, "customer", certificate.customer, reached)
    _statements(child(parent, "statements"), certificate)


def _software(parent: ET.Element, software: str) -> None:
    name, _, release = software.rpartition(" ")
    element = child(parent, "software")
    texts(element, "name", name)
    child(element, "release", f"v{release}")
    child(element, "type", "application")


def _core(parent: ET.Element, certificate: Certificate) -> None:
    child(parent, "countryCodeISO3166_1", certificate.laboratory.country)
    child(parent, "usedLangCodeISO639_1", ENGLISH)
    child(parent, "mandatoryLangCodeISO639_1", ENGLISH)
    child(parent, "uniqueIdentifier", certificate.number)
    identifications = child(parent, "identifications")
    _identification(
        identifications, "calibrationLaboratory", certificate.calibration.hash, "SHA-256 of the calibration"
    )
    _identification(
        identifications, "calibrationLaboratory", certificate.calibration.address, "Address of the calibration"
    )
    if certificate.state_address:
        name = "Address of the state of this certificate"
        _identification(identifications, "calibrationLaboratory", certificate.state_address, name)
    for manifest in certificate.manifests:
        name = f"SHA-256 of manifest {manifest.manifest}: {manifest.record}"
        _identification(identifications, "calibrationLaboratory", manifest.hash, name)
    if certificate.customer.order:
        _identification(identifications, "customer", certificate.customer.order, "Order")
    if certificate.item.received is not None:
        child(parent, "receiptDate", certificate.item.received.isoformat())
    child(parent, "beginPerformanceDate", certificate.performed_from.isoformat())
    child(parent, "endPerformanceDate", certificate.performed_until.isoformat())
    child(parent, "performanceLocation", certificate.laboratory.place)
    child(parent, "issueDate", certificate.issued_on.isoformat())
    if certificate.replaces is not None:
        changed = child(parent, "reportAmendedSubstituted")
        child(changed, "typeOfChange", "amended")
        child(changed, "replacedUniqueIdentifier", certificate.replaces.number)
        before = child(parent, "previousReport")
        texts(before, "referral", "Certificate that this one replaces")
        child(before, "referralID", certificate.replaces.number)
        child(before, "procedure", "SHA-256 of its JSON")
        child(before, "value", certificate.replaces.hash)
        texts(before, "description", f"Reason: {certificate.replaces.reason}")


def _identification(parent: ET.Element, issuer: str, value: str, name: str) -> None:
    element = child(parent, "identification")
    child(element, "issuer", issuer)
    child(element, "value", value)
    texts(element, "name", name)


def _item(parent: ET.Element, certificate: Certificate) -> None:
    element = child(parent, "item")
    item = certificate.item
    texts(element, "name", item.description)
    texts(element, "description", f"Axes: {', '.join(item.axes)}.", f"Condition on receipt: {item.condition}")
    texts(child(element, "manufacturer"), "name", item.manufacturer)
    child(element, "model", item.model)
    identifications = child(element, "identifications")
    _identification(identifications, "manufacturer", item.serial, "Serial number")
    if item.identification:
        _identification(identifications, "customer", item.identification, "Customer's number")


def _person(parent: ET.Element, name: str, role: str, *, signs: bool) -> None:
    element = child(parent, "respPerson")
    texts(child(element, "person"), "name", name)
    child(element, "role", role)
    child(element, "mainSigner", "true" if signs else "false")


def _statements(parent: ET.Element, certificate: Certificate) -> None:
    for text in certificate.statements:
        _statement(parent, "Statement", text)
    _statement(parent, "Adjustment", certificate.adjustment)
    _statement(parent, "Results of external providers", certificate.external)
    authorised = certificate.authorised
    _statement(parent, "Authorisation", f"{authorised.persons}, {authorised.at:%Y-%m-%d %H:%M} UTC: "
               f"{authorised.reason}")  # fmt: skip
    if certificate.due is not None:
        element = _statement(parent, "Next calibration", "Agreed with the customer.", ref_type="basic_recalibration")
        child(element, "date", certificate.due.isoformat())
    if certificate.conformity is not None:
        _conformity(parent, certificate.conformity, max(result.k for result in certificate.results))


def _conformity(parent: ET.Element, judged: Conformity, k: float) -> None:
    node = _statement(parent, "Conformity", judged.statement, norm=("ILAC-G8:09/2019",), reference=judged.specification,
                      ref_type="basic_conformity")  # fmt: skip
    child(node, "conformity", "pass" if judged.passed else "fail")
    data = child(node, "data")
    for name, limit, ref_type in (
        ("Limit of the error", judged.limit_dps, "basic_toleranceLimit"),
        ("Acceptance limit of the error", judged.acceptance_dps, "basic_acceptanceLimit"),
    ):
        quantity(data, f"{name}, lower", [-limit], "deg/s", ref_type=f"{ref_type}Lower")
        quantity(data, f"{name}, upper", [limit], "deg/s", ref_type=f"{ref_type}Upper")
    quantity(data, "Guard band", [judged.guard_band_dps], "deg/s")
    quantity(data, "Largest error of the corrected rate", [judged.largest_error_dps], "deg/s",
             expanded=[judged.expanded_dps], k=[k], ref_type="basic_measurementError")  # fmt: skip


def _statement(
    parent: ET.Element, name: str, text: str, *, norm: tuple[str, ...] = (), reference: str = "", ref_type: str = ""
) -> ET.Element:
    element = child(parent, "statement", **referred(ref_type))
    texts(element, "name", name)
    for each in norm:
        child(element, "norm", each)
    optional(element, "reference", reference)
    texts(element, "declaration", text)
    return element


def _measured(parent: ET.Element, certificate: Certificate) -> None:
    element = child(parent, "measurementResult")
    texts(element, "name", f"Calibration of {certificate.item.serial}, version {certificate.calibration.version}")
    methods = child(element, "usedMethods")
    _method(child(methods, "usedMethod"), certificate)
    stated = child(methods, "usedMethod", **referred("basic_uncertainty"))
    texts(stated, "name", "Uncertainty of measurement")
    texts(stated, "description", uncertainty_text(certificate))
    child(stated, "norm", "JCGM 100:2008")
    _software(child(element, "usedSoftware"), certificate.method.software)
    equipment = child(element, "measuringEquipments")
    for standard in certificate.standards:
        _standard(equipment, standard)
    conditions = child(element, "influenceConditions")
    for condition in certificate.environment:
        _condition(conditions, condition)
    _results(child(element, "results"), certificate)


def _condition(parent: ET.Element, condition: Condition) -> None:
    ref_type = CONDITIONS.get(condition.name, "")
    element = child(parent, "influenceCondition", **referred(ref_type))
    texts(element, "name", condition.name)
    data = child(element, "data")
    for name, value, suffix in (("Least", condition.low, "Min"), ("Largest", condition.high, "Max")):
        name_text = f"{name} value during the calibration"
        quantity(data, name_text, [value], condition.unit, ref_type=ref_type and f"{ref_type}{suffix}")


def _method(made: ET.Element, certificate: Certificate) -> None:
    method = certificate.method
    texts(made, "name", method.name)
    texts(
        made,
        "description",
        f"Error model {method.model}: {', '.join(method.effects)}.",
        *([f"Nominal {nominal}."] if (nominal := nominal_of(certificate)) else []),
        f"Recordings: {', '.join(map(str, method.recordings))}.",
        f"Additions to, deviations or exclusions from the method: {method.deviations}",
    )
    optional(made, "reference", method.procedure)
    if method.plan_hash:
        child(made, "reference", f"plan SHA-256 {method.plan_hash}")


def _standard(parent: ET.Element, standard: StandardUsed) -> None:
    element = child(parent, "measuringEquipment", **referred("basic_standardUsed"))
    texts(element, "name", standard.name or standard.quantity)
    sentences = [f"Reference standard of {standard.quantity}."]
    sentences += [f"Calibrated {standard.calibrated}."] if standard.calibrated else []
    sentences += [f"Due {standard.due}."] if standard.due else []
    sentences += [f"Traceability: {standard.traceability}."] if standard.traceability else []
    texts(element, "description", *sentences)
    if standard.certificate:
        identification = child(element, "identifications")
        _identification(identification, "calibrationLaboratory", standard.certificate,
                        f"Certificate of {standard.issued_by or 'its calibration'}")  # fmt: skip
    stated = child(element, "measuringEquipmentQuantities")
    quantity(stated, "Standard uncertainty", [standard.u], standard.unit, element="measuringEquipmentQuantity")


def _results(parent: ET.Element, certificate: Certificate) -> None:
    probability = certificate.uncertainty.coverage_probability
    for axis, of_axis in groupby(certificate.results, key=lambda point: point.axis):
        points = list(of_axis)
        element = _result(parent, f"Error of indication of axis {axis}", "Output by its nominal scale minus true rate.")
        table = child(element, "list")
        rates = [each.rate_dps for each in points]
        quantity(table, "True rate", rates, "deg/s", ref_type="basic_referenceValue")
        temperatures_c = [each.temperature_c for each in points if each.temperature_c is not None]
        if len(temperatures_c) == len(points):
            quantity(table, "Temperature of the item", temperatures_c, "deg C")
        quantity(
            table, "Error of indication", [each.error_dps for each in points], "deg/s",
            expanded=[each.expanded_dps for each in points], k=[each.k for each in points], probability=probability,
            ref_type="basic_measurementError",
        )  # fmt: skip
    _any_axis(parent, certificate)
    _state(parent, "Errors as found, before adjustment", certificate.as_found)
    _state(parent, "Errors as left, after adjustment", certificate.as_left)
    element = _result(
        parent,
        "Coefficients of the correction",
        "Of the error model that the method names; standard uncertainties contain the standards of the bench, or are "
        "those of the fit alone where the name says so.",
    )
    for coefficient in certificate.coefficients:
        place_text = "" if coefficient.temperature_c is None else f" at {coefficient.temperature_c:g} °C"
        alone = "" if coefficient.has_standards or coefficient.u is None else ", u of the fit alone"
        coefficient_name = coefficient.name_text if coefficient.unit == "s" else coefficient.name
        name = f"Axis {coefficient.axis}: {coefficient_name}{place_text}{alone}"
        quantity(element, name, [coefficient.value], coefficient.unit, u=coefficient.u)
    _budget(parent, certificate)
    for sensor in certificate.sensors:
        _sensor(parent, sensor, probability)


def _sensor(parent: ET.Element, result: SensorResult, probability: float) -> None:
    """Add the result of an accelerometer or magnetometer."""
    element = _result(
        parent,
        f"{result.sensor.capitalize()}, version {result.version}",
        f"{result.formula}. Verdict: {result.verdict}. {' '.join(result.found)} Holds for: {result.holds_for} "
        f"{result.not_stated} Measured {result.performed_from} to {result.performed_until}. Reference: "
        f"{reference_text(result.reference)}. Files, SHA-256: {'; '.join(result.files)}. SHA-256 of the result: "
        f"{result.hash}.",
    )
    reference = result.reference
    quantity(element, f"Reference: {reference.quantity}", [reference.value], reference.unit, u=reference.u)
    for coefficient in result.coefficients:
        quantity(
            element,
            coefficient.name,
            [coefficient.value],
            coefficient.unit,
            expanded=[coefficient.expanded],
            k=[coefficient.k],
            probability=probability,
        )


def _any_axis(parent: ET.Element, certificate: Certificate) -> None:
    known = [each for each in certificate.any_axis if each.expanded_dps is not None]
    if not known:
        return
    element = _result(
        parent,
        "Largest expanded uncertainty of a corrected rate about any axis",
        f"Rate vectors of any direction up to {max(each.reach_dps for each in known):.6g} °/s.",
    )
    for each in known:
        for frame, value in (
            ("in the frame of the case", each.expanded_dps),
            ("up to a rotation of the frame", each.aligned_expanded_dps),
        ):
            if value is not None:
                quantity(element, f"Output {each.output}, {frame}", [value], "deg/s")
        if each.per_dps_across is not None:
            name = f"Output {each.output}, error per deg/s about {' and '.join(each.across)}"
            quantity(element, name, [each.per_dps_across], "1")


def _budget(parent: ET.Element, certificate: Certificate) -> None:
    uncertainty = certificate.uncertainty
    temperature_text = "" if uncertainty.temperature_c is None else f" and {uncertainty.temperature_c:g} °C"
    place_text = f"Of axis {uncertainty.axis} at {uncertainty.rate_dps:g} °/s{temperature_text}, where U is largest."
    element = _result(parent, "Contributions to the standard uncertainty", place_text)
    for each in uncertainty.budget:
        quantity(element, f"{each.source}, type {each.type}", [each.contribution_dps], "deg/s")


def _result(parent: ET.Element, name: str, description: str) -> ET.Element:
    element = child(parent, "result")
    texts(element, "name", name)
    texts(element, "description", description)
    return child(element, "data")


def _state(parent: ET.Element, name: str, state: StateOfItem) -> None:
    element = _result(parent, name, f"Corrected by {state.basis}; over {state.datasets} data sets.")
    for each in state.axes:
        for what, value in (("RMS error", each.rms_dps), ("Largest error", each.max_dps)):
            quantity(element, f"{what} of axis {each.axis}, {readable('deg/s')}", [value], "deg/s")
