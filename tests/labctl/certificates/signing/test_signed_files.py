"""Signed PDF and DCC: valid by other hands than signed them, a changed byte is found by each, and both stay what they
were: PDF/A-3 with its attachment, a DCC by PTB's rules."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from datetime import timedelta
from functools import cache
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree as ET

import pikepdf
import pytest
from dcclib.validation import SchematronValidator
from hypothesis import given, settings
from hypothesis import strategies as st
from lxml import etree

from labctl.certificates.signing import SigningSettings
from labctl.certificates.signing.keys import open_signing_key
from labctl.certificates.signing.pades import sign_pdf
from labctl.certificates.signing.verification import SignatureFound, signatures_of_dcc, signatures_of_pdf
from labctl.certificates.signing.xades import sign_dcc
from labctl.errors import BadInput
from tests.helpers.certificates import issued
from tests.helpers.dcc_schema import needs_schema, schema_objections
from tests.helpers.signing import AT, KINDS, Owner, key_file, owner, pdf_verifies, xml_verifies

DS, XADES = "{http://www.w3.org/2000/09/xmldsig#}", "{http://uri.etsi.org/01903/v1.3.2#}"
#: The rules object to every empty element; these of a signature are always empty (XML Signature 1.1), in PTB's own too.
EMPTY = re.compile(r"xmldsig#\}(CanonicalizationMethod|SignatureMethod|Transform|DigestMethod)\[\d+\]$")
PDFA = "{http://www.aiim.org/pdfa/ns/id/}"


@dataclass(frozen=True)
class Signed:
    """A certificate whose PDF and DCC are signed."""

    signer: Owner
    authority: Owner
    xml: bytes
    pdf: bytes


@cache
def signed(kind: str) -> Signed:
    authority = owner("Root authority", authority=True, signs=False)
    signer = owner("Ada Authoriser", kind, authority)
    with TemporaryDirectory() as folder:
        key = open_signing_key(SigningSettings(str(key_file(Path(folder), signer))))
    forms = issued()[1]
    return Signed(signer, authority, sign_dcc(forms.xml, key, AT), sign_pdf(forms.pdf, key, AT))


def found(content: bytes, given: Signed | None = None) -> SignatureFound:
    look = signatures_of_pdf if content.startswith(b"%PDF") else signatures_of_dcc
    return look(content, None if given is None else [given.authority.certificate])[0]


@pytest.mark.parametrize("kind", KINDS)
def test_the_signatures_are_valid_by_other_hands(kind: str) -> None:
    made = signed(kind)
    assert xml_verifies(made.xml, made.signer.certificate)
    assert pdf_verifies(made.pdf, made.signer.certificate)
    for content in (made.xml, made.pdf):
        said = found(content, made)
        assert (said.valid, said.trust, said.signed_at) == (True, "trusted", AT)
        assert said.signatory is not None
        assert said.signatory.subject == "CN=Ada Authoriser,O=Lab & Sons"


@pytest.mark.parametrize("kind", KINDS)
def test_signatures_fail_with_another_certificate(kind: str) -> None:
    made, other = signed(kind), owner("Ada Authoriser", kind)
    assert not xml_verifies(made.xml, other.certificate)
    assert not pdf_verifies(made.pdf, other.certificate)


@settings(max_examples=25, deadline=None)
@given(st.data())
def test_a_changed_byte_of_the_pdf_is_found_by_each(data: st.DataObject) -> None:
    made = signed("p256")
    end = made.pdf.rindex(b"/Contents <")
    where = data.draw(st.integers(20, end - 1))
    changed = bytearray(made.pdf)
    changed[where] ^= data.draw(st.integers(1, 255))
    with suppress(ValueError):  # a second /ByteRange, or none, is no signed PDF either
        assert not pdf_verifies(bytes(changed), made.signer.certificate)
    with suppress(BadInput):  # the file can no longer be read
        assert not all(each.valid for each in signatures_of_pdf(bytes(changed), None) or [SignatureFound("PAdES")])


@settings(max_examples=25, deadline=None)
@given(st.data())
def test_a_changed_digit_of_the_dcc_is_found_by_each(data: st.DataObject) -> None:
    made = signed("p256")
    end = made.xml.index(b"<ds:Signature ")
    digits = [i for i in range(200, end) if made.xml[i : i + 1].isdigit()]
    where = data.draw(st.sampled_from(digits))
    changed = made.xml[:where] + bytes([ord("0") + (made.xml[where] - ord("0") + 1) % 10]) + made.xml[where + 1 :]
    try:
        etree.fromstring(changed)
    except etree.XMLSyntaxError:  # the digit is of one of the two names of an element
        with pytest.raises(BadInput):
            found(changed)
        return
    assert not xml_verifies(changed, made.signer.certificate)
    said = found(changed)
    assert not said.valid
    assert said.problem


@pytest.mark.parametrize(
    "change",
    [
        lambda xml: xml.replace(b"T12:00:00+00:00</xades:SigningTime>", b"T11:00:00+00:00</xades:SigningTime>"),
        lambda xml: xml.replace(b"</dcc:digitalCalibrationCertificate>", b"<x/></dcc:digitalCalibrationCertificate>"),
        lambda xml: xml.replace(b' URI="" ', b' URI="#none" '),
    ],
)
def test_time_place_and_reference_are_signed_too(change: Callable[[bytes], bytes]) -> None:
    changed = change(signed("p256").xml)
    assert changed != signed("p256").xml
    assert not found(changed).valid


def test_what_is_added_to_a_signed_pdf_is_found() -> None:
    with pikepdf.open(BytesIO(signed("p256").pdf)) as opened:
        opened.Root.Lang = pikepdf.String("de")
        again = BytesIO()
        opened.save(again)
    assert not found(again.getvalue()).valid
    said = found(signed("p256").pdf + b"\n% more\n")
    assert (said.valid, said.problem) == (False, "something was added to the file after it was signed")


def test_without_a_named_authority_trust_is_not_established() -> None:
    made = signed("p256")
    said = found(made.pdf)
    assert (said.valid, said.trust) == (True, "not established")
    assert "issued by CN=Root authority,O=Lab & Sons: trust not established" in said.reason
    stranger = owner("Root authority", authority=True, signs=False)
    other = signatures_of_dcc(made.xml, [stranger.certificate])[0]
    assert (other.valid, other.trust) == (True, "not trusted")
    assert other.reason


def test_a_self_signed_certificate_says_so_and_is_trusted_only_when_it_is_named(tmp_path: Path) -> None:
    alone = owner("Alone")
    key = open_signing_key(SigningSettings(str(key_file(tmp_path, alone))))
    xml = sign_dcc(issued()[1].xml, key, AT)
    assert signatures_of_dcc(xml, None)[0].reason.startswith("self-signed: trust not established")
    assert signatures_of_dcc(xml, [alone.certificate])[0].trust == "trusted"


def test_a_signature_outside_the_validity_of_its_certificate_is_not_valid(tmp_path: Path) -> None:
    late = owner("Late", days=(-10, -1))
    key = open_signing_key(SigningSettings(str(key_file(tmp_path, late))))  # issue refuses it; here it signs
    for content in (sign_dcc(issued()[1].xml, key, AT), sign_pdf(issued()[1].pdf, key, AT)):
        said = found(content)
        assert not said.valid
        assert "valid" in said.problem
        assert found(sign_dcc(issued()[1].xml, key, AT - timedelta(days=5))).valid


def test_a_second_signature_is_refused() -> None:
    xml = signed("p256").xml
    start = xml.index(b"<ds:Signature ")
    end = xml.index(b"</ds:Signature>") + len(b"</ds:Signature>")
    assert "2 signatures" in found(xml[:end] + xml[start:end] + xml[end:]).problem


def test_the_signed_dcc_is_valid_by_ptbs_rules_with_the_signature_at_its_end() -> None:
    xml = signed("p256").xml
    reports = SchematronValidator.for_dcc().validate_str(xml.decode())
    said = [*reports.failed_assertions, *reports.successful_reports]
    assert said
    objections = [each for each in said if each.role != "information"]
    assert [each.text for each in objections if not EMPTY.search(each.location)] == []
    assert {each.text.partition(".")[0] for each in objections} <= {"Empty element"}
    root = ET.fromstring(xml)
    assert root[-1].tag == f"{DS}Signature"
    assert [each.text for each in root.iter(f"{XADES}SigningTime")] == ["2027-03-01T12:00:00+00:00"]
    unsigned = ET.fromstring(issued()[1].xml)
    assert [ET.tostring(each) for each in root[:-1]] == [ET.tostring(each) for each in unsigned]


@needs_schema
@pytest.mark.parametrize("kind", KINDS)
def test_the_schema_of_ptb_accepts_the_signed_dcc(kind: str) -> None:
    assert schema_objections(signed(kind).xml) == []


@pytest.mark.parametrize("kind", KINDS)
def test_the_signed_pdf_is_still_pdf_a_3(kind: str) -> None:
    before, pdf = issued()[1].pdf, signed(kind).pdf
    assert pdf.startswith(before)  # appended: the pages are those that were compiled
    with pikepdf.open(BytesIO(pdf)) as opened, pikepdf.open(BytesIO(before)) as first:
        stream = opened.Root.Metadata
        assert "/Filter" not in stream
        assert stream.read_bytes() == first.Root.Metadata.read_bytes()
        assert {each.text for each in ET.fromstring(stream.read_bytes()).iter(f"{PDFA}part")} == {"3"}
        assert dict(opened.docinfo) == dict(first.docinfo)
        assert opened.attachments["dcc.xml"].get_file().read_bytes() == issued()[1].xml
        assert opened.pdf_version == "1.7"
        assert "/Version" not in opened.Root
        for key in ("/OutputIntents", "/StructTreeRoot", "/MarkInfo", "/Lang", "/AF", "/Names"):
            assert repr(opened.Root[key]) == repr(first.Root[key])
        (field,) = opened.Root.AcroForm.Fields
        assert "/NeedAppearances" not in opened.Root.AcroForm
        assert int(field.F) & 0b111 == 0b100  # printed, neither hidden nor invisible, as PDF/A asks of annotations
        assert [float(each) for each in field.Rect] == [0, 0, 0, 0]  # without a place on the page it needs no picture
        assert field.V.SubFilter == "/ETSI.CAdES.detached"
        assert str(field.V.M) == "D:20270301120000Z"
        assert len(opened.pages) == len(first.pages)
