"""RefTypes of the DCC: PTB's words, on the elements that PTB uses them on, for the quantities that they mean."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from labctl.certificates.dcc import CONDITIONS, dcc_of
from labctl.certificates.document import Certificate, Condition
from labctl.services.certificates import measured
from tests.helpers.certificates import issued

DCC, SI = "{https://ptb.de/dcc}", "{https://ptb.de/si}"
FACTS = tomllib.loads((Path(__file__).parent / "dcc_ref_types.toml").read_text(encoding="utf-8"))["elements"]


@cache
def certificate() -> Certificate:
    """Return a certificate with a due date and with every condition for which PTB has a refType."""
    given = Certificate.model_validate_json(issued()[1].document)
    environment = tuple(
        Condition(name=name, unit=unit, low=1.5, high=2.5) for name, unit in measured.CONDITIONS.values()
    )
    return given.model_copy(update={"environment": environment, "due": given.issued_on})


def root() -> ET.Element:
    return ET.fromstring(dcc_of(certificate()))


def of_type(ref_type: str) -> list[ET.Element]:
    return [each for each in root().iter() if each.get("refType") == ref_type]


def value(element: ET.Element) -> float:
    (found,) = element.iter(f"{SI}value")
    return float(found.text or "nan")


def test_every_ref_type_is_ptbs_and_on_the_elements_that_ptb_uses_it_on() -> None:
    used = [(ref, each.tag.removeprefix(DCC)) for each in root().iter() for ref in each.get("refType", "").split()]
    assert len({ref for ref, _ in used}) >= 14
    assert [pair for pair in used if pair[1] not in FACTS.get(pair[0], "").split()] == []


def test_the_namespace_is_defined_where_a_reader_of_the_file_finds_it() -> None:
    (namespace,) = root().iter(f"{DCC}namespace")
    prefixes = {ref.partition("_")[0] for each in root().iter() for ref in each.get("refType", "").split()}
    assert prefixes == {namespace.text}


@pytest.mark.parametrize(
    ("ref_type", "name"),
    [
        ("basic_referenceValue", "True rate"),
        ("basic_standardUsed", None),
        ("basic_uncertainty", "Uncertainty of measurement"),
        ("basic_conformity", "Conformity"),
        ("basic_recalibration", "Next calibration"),
        ("basic_temperature", "Temperature of the chamber air"),
        ("basic_humidityRelative", "Relative humidity of the air"),
    ],
)
def test_a_ref_type_is_on_what_it_means(ref_type: str, name: str | None) -> None:
    named = [each.findtext(f"{DCC}name/{DCC}content") for each in of_type(ref_type)]
    assert len(named) == (len(certificate().standards) if name is None else 1)
    assert name is None or named == [name]


def test_limits_of_the_conformity_are_those_of_the_document() -> None:
    stated = certificate().conformity
    assert stated is not None
    for ref_type, limit in (
        ("basic_toleranceLimitLower", -stated.limit_dps), ("basic_toleranceLimitUpper", stated.limit_dps),
        ("basic_acceptanceLimitLower", -stated.acceptance_dps), ("basic_acceptanceLimitUpper", stated.acceptance_dps),
    ):  # fmt: skip
        (found,) = of_type(ref_type)
        assert value(found) == pytest.approx(limit)
    assert stated.acceptance_dps < stated.limit_dps
    at_most, *table = sorted(of_type("basic_measurementError"), key=lambda each: each.find(f"{SI}real") is None)
    assert value(at_most) == pytest.approx(stated.largest_error_dps)
    assert len(table) == 1


def test_least_and_largest_of_a_condition_are_two_quantities() -> None:
    for ref_type in CONDITIONS.values():
        (least,), (largest,) = of_type(f"{ref_type}Min"), of_type(f"{ref_type}Max")
        assert (value(least), value(largest)) == (1.5, 2.5)


def test_conditions_with_a_ref_type_are_those_that_a_certificate_names() -> None:
    assert set(CONDITIONS) <= {name for name, _ in measured.CONDITIONS.values()}
