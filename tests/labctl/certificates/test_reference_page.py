"""The page of the certificate: each item of ISO/IEC 17025 once, and each place of it in a certificate."""

from __future__ import annotations

import json
import re
from typing import Any
from xml.etree import ElementTree as ET

import pytest

from labctl.certificates.document import Certificate
from labctl.certificates.readable import readable_certificate
from tests.helpers.certificates import issued
from tests.helpers.paths import ROOT

TEMPLATE = ROOT / "labctl" / "certificates" / "template.typ"
DCC = "{https://ptb.de/dcc}"
ROW = re.compile(r"^\| (7\.8\.\S+ \w) \| (.+?) \| (.+?) \| (.+?) \| (.+?) \|$", re.MULTILINE)
ROWS = {row[0]: row[1:] for row in ROW.findall((ROOT / "docs/reference/certificate.md").read_text(encoding="utf-8"))}
#: Where an item is stated by a word that the certificate of the tests has no fact for.
WITHOUT = {"7.8.2.1 h": "the order of the tests states no date of receipt"}


def test_every_item_is_there_once() -> None:
    items = [f"7.8.2.1 {letter}" for letter in "abcdefghijklmnop"] + [f"7.8.4.1 {letter}" for letter in "abcdef"]
    assert list(ROWS) == items


@pytest.mark.parametrize("item", ROWS)
def test_the_item_is_where_the_page_says(item: str) -> None:
    _, page, path, key = ROWS[item]
    given = Certificate.model_validate_json(issued()[1].document)
    printed = TEMPLATE.read_text(encoding="utf-8") + readable_certificate(given).decode()
    for words in re.findall(r'"([^"]+)"', page):
        assert words in printed, words
    if path.startswith("`") and item not in WITHOUT:
        place = "/".join(f"{DCC}{part}" for part in path.strip("`").split("/")) if path != "`.`" else "."
        assert ET.fromstring(issued()[1].xml).find(place) is not None, path
    if key.startswith("`"):
        found: Any = json.loads(issued()[1].document)
        for part in key.strip("`").split("."):
            assert part in found, key
            found = found[part]
        assert found not in ("", [], {}) or item in WITHOUT


def test_the_manifests_of_the_recordings_and_of_the_certification_are_on_every_form() -> None:
    forms = issued()[1]
    named = Certificate.model_validate_json(forms.document).manifests
    assert [each.record for each in named] == ["recording 1", "certification of FOG-0001 version 1"]
    identified = {each.text for each in ET.fromstring(forms.xml).iter(f"{DCC}value")}
    printed = readable_certificate(Certificate.model_validate_json(forms.document)).decode()
    for each in named:
        assert len(each.hash) == 64
        assert each.hash in identified
        assert each.hash in printed
    assert "given.manifests" in TEMPLATE.read_text(encoding="utf-8")
