"""The DCC: order, mandatory elements and words of the schema 3.3.0, and every number that the JSON has.

The facts of the schema below are of PTB's dcc.xsd 3.3.0 (LGPL-3.0), which is not part of this repository. Where its
files are at hand, `LABCTL_DCC_SCHEMA` names their folder, and the certificate is validated by them too. PTB's rules
beyond the schema are in test_dcc_schematron.py.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree as ET

import pytest

from labctl.certificates.units import dsi, readable
from tests.helpers.certificates import issued
from tests.helpers.dcc_schema import needs_schema, schema_objections

DCC, SI = "{https://ptb.de/dcc}", "{https://ptb.de/si}"
#: Element -> its children in the order of the schema; those that must be there end with "!".
SEQUENCES = {
    "digitalCalibrationCertificate": "administrativeData! measurementResults! comment document",
    "software": "name! release! type description",
    "coreData": (
        "countryCodeISO3166_1! usedLangCodeISO639_1! mandatoryLangCodeISO639_1! uniqueIdentifier! identifications "
        "receiptDate beginPerformanceDate! endPerformanceDate! performanceLocation! issueDate "
        "reportAmendedSubstituted previousReport"
    ),
    "item": (
        "name! equipmentClass description owner installedSoftwares manufacturer model identifications! itemQuantities "
        "subItems"
    ),
    "identification": "issuer! value! name",
    "calibrationLaboratory": "calibrationLaboratoryCode contact!",
    "respPerson": "person! description role mainSigner",
    "contact": "name! eMail phone fax link location! descriptionData",
    "customer": "name! eMail phone fax link location! descriptionData",
    "statement": (
        "name description countryCodeISO3166_1 convention traceable norm reference link declaration valid date period "
        "respAuthority conformity data nonSIDefinition nonSIUnit location"
    ),
    "measurementResult": (
        "name! description usedMethods usedSoftware measuringEquipments influenceConditions results! "
        "measurementMetaData"
    ),
    "usedMethod": "name! description norm reference link usedMethodQuantities",
    "measuringEquipment": (
        "name! equipmentClass description certificate manufacturer model identifications "
        "measuringEquipmentQuantities installedSoftware"
    ),
    "influenceCondition": "name! description status certificate data!",
    "result": "name! description data!",
    "list": "name description dateTime quantity usedMethods",
    "real": "label quantityType value! unit! significantDigit dateTime measurementUncertaintyUnivariate",
    "realListXMLList": "labelXMLList valueXMLList! unitXMLList! measurementUncertaintyUnivariateXMLList",
    "expandedMU": "valueExpandedMU! coverageFactor! coverageProbability! distribution",
    "expandedMUXMLList": (
        "valueExpandedMUXMLList! coverageFactorXMLList! coverageProbabilityXMLList! distributionXMLList"
    ),
}
WORDS = {
    "issuer": {"manufacturer", "calibrationLaboratory", "customer", "owner", "other"},
    "performanceLocation": {"laboratory", "customer", "laboratoryBranch", "customerBranch", "other"},
    "conformity": {"pass", "fail", "conditionalPass", "conditionalFail", "noPass", "noFail"},
    "type": {"application", "bios", "driver", "editor", "firmware", "library", "os", "other"},
    "mainSigner": {"true", "false"},
    "countryCode": {"DE", "GB"},
}
#: A text of the schema has no space at its ends and is not empty.
TEXT = re.compile(r"\S+(\s+\S+)*")
#: Schematron of PTB: a release is a letter and up to four numbers.
RELEASE = re.compile(r"[a-zA-Z] ?(\d{1,3}\.){0,3}\d{1,3}")


@pytest.fixture(scope="module")
def root() -> ET.Element:
    return ET.fromstring(issued()[1].xml)


@pytest.fixture(scope="module")
def document() -> Any:
    return json.loads(issued()[1].document)


def name_of(element: ET.Element) -> str:
    return element.tag.rpartition("}")[2]


def text_of(root: ET.Element, path: str) -> str:
    found = root.find(path.replace("dcc:", DCC).replace("si:", SI))
    assert found is not None, path
    return "".join(found.itertext()).strip()


def numbers_of(element: ET.Element, tag: str) -> list[float]:
    return [float(part) for each in element.iter(SI + tag) for part in (each.text or "").split()]


def breaches(root: ET.Element) -> Iterator[str]:
    """Yield each breach of the facts above."""
    for element in root.iter():
        name, children = name_of(element), [name_of(child) for child in element]
        if name in SEQUENCES:
            words = SEQUENCES[name].split()
            order = [word.rstrip("!") for word in words]
            yield from (f"{name} has no {word}" for word in words if word.endswith("!") and word[:-1] not in children)
            places = [order.index(child) if child in order else -1 for child in children]
            if -1 in places or places != sorted(places):
                yield f"{name}: {children}"
        said = (element.text or "").strip()
        if not children and not TEXT.fullmatch(element.text or ""):
            yield f"{name} is {element.text!r}"
        if name in WORDS and said not in WORDS[name]:
            yield f"{name} = {said!r}"
        if name == "release" and not RELEASE.fullmatch(said):
            yield f"release {said!r}"


def test_it_keeps_the_order_and_the_words_of_the_schema(root: ET.Element) -> None:
    assert root.get("schemaVersion") == "3.3.0"
    assert list(breaches(root)) == []


@pytest.mark.parametrize("gone", ["uniqueIdentifier", "manufacturer", "results"])
def test_a_breach_is_found(gone: str) -> None:
    broken = ET.fromstring(issued()[1].xml)
    for parent in broken.iter():
        for each in [child for child in parent if name_of(child) == gone]:
            parent.remove(each)
            if gone == "manufacturer":
                parent.append(each)
    assert list(breaches(broken))


@needs_schema
def test_the_schema_of_ptb_accepts_it() -> None:
    assert schema_objections(issued()[1].xml) == []


def test_every_result_has_its_expanded_uncertainty(root: ET.Element, document: Any) -> None:
    (table,) = root.iter(DCC + "list")
    rate, temperature, error = table.findall(DCC + "quantity")
    assert numbers_of(rate, "valueXMLList") == pytest.approx([each["rate_dps"] for each in document["results"]])
    warm = [each["temperature_c"] for each in document["results"]]
    assert numbers_of(temperature, "valueXMLList") == pytest.approx(warm)
    assert numbers_of(error, "valueXMLList") == pytest.approx([each["error_dps"] for each in document["results"]])
    expanded = [each["expanded_dps"] for each in document["results"]]
    assert numbers_of(error, "valueExpandedMUXMLList") == pytest.approx(expanded)
    assert min(expanded) > 0
    assert numbers_of(error, "coverageFactorXMLList") == pytest.approx([each["k"] for each in document["results"]])
    assert text_of(error, ".//si:unitXMLList") == r"\degree\second\tothe{-1}"


def test_texts_with_markup_and_white_space_stay_as_they_are(root: ET.Element) -> None:
    customer = "dcc:administrativeData/dcc:customer/"
    assert text_of(root, customer + "dcc:name") == "Vehicle Works <Ltd.>"
    assert text_of(root, "dcc:administrativeData/dcc:calibrationLaboratory/dcc:contact/dcc:name").count("&") == 1


@pytest.mark.parametrize(
    ("unit", "written"),
    [
        ("deg/s", r"\degree\second\tothe{-1}"),
        ("deg/s/K^2", r"\degree\second\tothe{-1}\kelvin\tothe{-2}"),
        ("1/K", r"\kelvin\tothe{-1}"),
        ("deg/s/(K/min)", r"\degree\second\tothe{-1}\kelvin\tothe{-1}\minute"),
        ("1", r"\one"),
        ("deg C", r"\degreecelsius"),
        ("ppm", r"\ppm"),
        ("deg/s/g", None),
        ("(deg/s)^-2", None),
    ],
)
def test_units_are_written_in_dsi_or_not_at_all(unit: str, written: str | None) -> None:
    assert dsi(unit) == written


def test_units_are_read_with_the_sign_of_degrees() -> None:
    assert [readable(unit) for unit in ("deg/s", "deg C", "deg/s/K", "V")] == ["°/s", "°C", "°/s/K", "V"]
