"""The PDF by another library than made it: what PDF/A-3 asks of metadata, colours, fonts, tags and attachments.

Of ISO 19005-3 only what is listed here is checked. veraPDF, which checks more of it, is no package that could be
installed here; it checks neither the text in the place of a picture nor the language.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from io import BytesIO
from xml.etree import ElementTree as ET

import pikepdf
import pytest

from labctl.certificates.document import Certificate
from labctl.certificates.pdf import pdf_of
from labctl.certificates.readable import BREAK, readable_certificate, rounded
from labctl.errors import BadInput
from tests.helpers.certificates import issued

PDFA = "{http://www.aiim.org/pdfa/ns/id/}"
#: What PDF/A forbids in a document's catalogue.
FORBIDDEN = ("/OpenAction", "/AA", "/NeedsRendering", "/Perms")


@pytest.fixture(scope="module")
def pdf() -> Iterator[pikepdf.Pdf]:
    with pikepdf.open(BytesIO(issued()[1].pdf)) as opened:
        yield opened


def certificate() -> Certificate:
    return Certificate.model_validate_json(issued()[1].document)


def test_the_metadata_claim_pdf_a_3_and_agree_with_the_information(pdf: pikepdf.Pdf) -> None:
    stream = pdf.Root.Metadata
    assert "/Filter" not in stream
    found = ET.fromstring(stream.read_bytes())
    assert [each.text for each in found.iter(PDFA + "part")] == ["3"]
    assert [each.text for each in found.iter(PDFA + "conformance")] == ["A"]
    with pdf.open_metadata() as metadata:
        assert metadata["dc:title"] == f"Calibration certificate {issued()[0].number}"
        assert metadata["xmp:CreateDate"].startswith("2027-03-01T00:00:00")
    assert not pdf.is_encrypted
    assert len(pdf.trailer.ID) == 2


def test_colours_have_an_output_intent(pdf: pikepdf.Pdf) -> None:
    (intent,) = pdf.Root.OutputIntents
    assert intent.S == "/GTS_PDFA1"
    assert intent.DestOutputProfile.read_bytes()[36:40] == b"acsp"  # the signature of an ICC profile


def test_every_font_is_embedded_and_maps_to_unicode(pdf: pikepdf.Pdf) -> None:
    fonts = [each for each in pdf.objects if isinstance(each, pikepdf.Dictionary) and each.get("/Type") == "/Font"]
    descriptors = [
        each for each in pdf.objects if isinstance(each, pikepdf.Dictionary) and each.get("/Type") == "/FontDescriptor"
    ]
    assert fonts
    assert descriptors
    assert all({"/FontFile2", "/FontFile3"} & set(each.keys()) for each in descriptors)
    assert all("/ToUnicode" in each for each in fonts if each.get("/Subtype") == "/Type0")


def test_the_dcc_is_attached_as_an_alternative(pdf: pikepdf.Pdf) -> None:
    assert list(pdf.attachments) == ["dcc.xml"]
    assert pdf.attachments["dcc.xml"].get_file().read_bytes() == issued()[1].xml
    (spec,) = pdf.Root.AF
    assert spec.AFRelationship == "/Alternative"
    assert spec.F == spec.UF == "dcc.xml"
    assert spec.EF.F.Subtype == "/application/xml"
    assert "/ModDate" in spec.EF.F.Params


def test_it_is_tagged_and_has_nothing_that_is_forbidden(pdf: pikepdf.Pdf) -> None:
    assert pdf.Root.MarkInfo.Marked
    assert "/StructTreeRoot" in pdf.Root
    assert str(pdf.Root.Lang).startswith("en")
    assert not set(FORBIDDEN) & set(pdf.Root.keys())
    assert not re.search(rb"/(JavaScript|Launch|LZWDecode|Encrypt)\b", issued()[1].pdf)
    pictures = [each for each in pdf.objects if isinstance(each, pikepdf.Stream) and each.get("/Subtype") == "/Image"]
    assert not any(each.get("/Interpolate", False) for each in pictures)


def test_every_picture_has_a_text_in_its_place(pdf: pikepdf.Pdf) -> None:
    figures = [each for each in pdf.objects if isinstance(each, pikepdf.Dictionary) and each.get("/S") == "/Figure"]
    assert [str(each.Alt).partition(":")[0] for each in figures] == ["QR code"]


def test_a_text_that_the_fonts_cannot_show_is_refused() -> None:
    given = certificate()
    customer = given.customer.model_copy(update={"name": "車輛"})
    with pytest.raises(BadInput, match=r"cannot be printed.*use Latin"):
        pdf_of(given.model_copy(update={"customer": customer}), b"<a/>")


def test_texts_of_the_order_are_data_and_no_program() -> None:
    given = certificate()
    customer = given.customer.model_copy(update={"name": '#read("main.typ") $x$ *b*'})
    assert pdf_of(given.model_copy(update={"customer": customer}), b"<a/>")


def test_a_long_word_in_a_name_can_be_broken_and_other_names_stay_as_they_are() -> None:
    given = certificate()
    changed = given.model_copy(update={"issued_by": "x" * 5000, "issued_by_identity": ""})
    printed = json.loads(readable_certificate(changed))["issued_by"]
    assert max(len(each) for each in printed.split(BREAK)) <= 30
    assert printed.replace(BREAK, "") == "x" * 5000
    assert pdf_of(changed, b"<a/>")
    assert BREAK not in readable_certificate(given).decode()


@pytest.mark.parametrize(
    ("value", "expanded", "shown"),
    [
        (1.23456, 0.0123, ("1.235", "0.013")),
        (-0.0004, 0.01, ("0.000", "0.010")),
        (-12.3456, 0.5, ("−12.35", "0.50")),
        (1234.5, 23.0, ("1234", "23")),
        (1250.0, 230.0, ("1250", "230")),
        (0.5, 0.0, ("0.5", "–")),
    ],
)
def test_results_are_rounded_to_two_digits_of_u_and_u_is_rounded_up(
    value: float, expanded: float, shown: tuple[str, str]
) -> None:
    assert rounded(value, expanded) == shown


def test_pages_say_what_the_json_says() -> None:
    pages, document = json.loads(readable_certificate(certificate())), json.loads(issued()[1].document)
    assert pages["number"] == document["number"]
    assert pages["hash"] == document["calibration"]["hash"]
    assert len(pages["results"][0]["rows"]) == len(document["results"])
    assert pages["conformity"]["statement"] == document["conformity"]["statement"]


def test_small_coefficients_have_a_power_of_ten_and_units_raised_powers() -> None:
    given = certificate()
    cubic = given.coefficients[0].model_copy(
        update={"name": "c_r3_t1", "unit": "(deg/s)^-2 K^-1", "value": -2.97e-9, "u": 9.2e-11}
    )
    tiny = json.loads(readable_certificate(given.model_copy(update={"coefficients": (cubic,)})))["coefficients"][0]
    assert tiny[3].removesuffix(" *") == "−2.970 × 10⁻⁹"
    assert tiny[4].removesuffix(" *") == "0.092 × 10⁻⁹"
    assert tiny[5] == "(°/s)⁻² K⁻¹"
    contributions = [row[2] for row in json.loads(readable_certificate(given))["budget"]]
    assert contributions
    assert all(len(text.replace(".", "").lstrip("0")) == 2 for text in contributions if float(text))
