"""The DCC by other hands: PTB's rules for it, written in Schematron, as the package dcclib carries them."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from dcclib.validation import SchematronValidator

from labctl.services.certificates.issue import issue
from labctl.store import open_store
from tests.helpers.certificates import AT, SERIAL, add_version, issued, request

#: A report of the rules is information, a warning or an error.
INFORMATION = "information"


@pytest.fixture(scope="module")
def rules() -> SchematronValidator:
    return SchematronValidator.for_dcc()


def objections(rules: SchematronValidator, xml: str) -> list[tuple[str, str]]:
    found = rules.validate_str(xml)
    reports = [*found.failed_assertions, *found.successful_reports]
    assert reports, "the rules reported nothing at all, not even information"
    return [(each.role, each.text) for each in reports if each.role != INFORMATION]


def test_the_rules_of_ptb_object_to_nothing(rules: SchematronValidator) -> None:
    assert objections(rules, issued()[1].xml.decode()) == []


def test_nor_in_a_certificate_with_only_the_mandatory_facts_that_replaces_another(
    rules: SchematronValidator, tmp_path: Path
) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        version = add_version(store)
        first = issue(store, SERIAL, version, request(conformity=None), AT)
        amended = request(conformity=None).model_copy(update={"amend": "The address of the customer was wrong."})
        second = issue(store, SERIAL, version, amended, AT)
        xml = store.certificates.forms(second.number).xml.decode()
    assert second.replaces == first.number != second.number
    assert objections(rules, xml) == []


@pytest.mark.parametrize(
    ("without", "role"), [("usedMethods", "error"), ("influenceConditions", "error"), ("usedSoftware", "warning")]
)
def test_a_certificate_without_it_is_objected_to(rules: SchematronValidator, without: str, role: str) -> None:
    broken = ET.fromstring(issued()[1].xml)
    for parent in broken.iter():
        for each in [child for child in parent if child.tag.endswith(f"}}{without}")]:
            parent.remove(each)
    assert role in {found for found, _ in objections(rules, ET.tostring(broken, encoding="unicode"))}
