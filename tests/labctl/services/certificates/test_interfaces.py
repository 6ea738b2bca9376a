"""Certificates on the command line and over HTTP: the same bytes, one line where facts are missing, the list."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import tomli_w

from labctl.store import open_store
from tests.helpers.certificates import ORDER, SERIAL, add_version
from tests.helpers.lab import Lab
from tests.helpers.service import open_client

UNIT = f"/api/units/{SERIAL}"
PATH = f"{UNIT}/calibrations/1/certificate"


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    lab = Lab(tmp_path)
    with open_store(str(lab.database), write=True) as store:
        add_version(store)
    (tmp_path / "order.toml").write_text(tomli_w.dumps(ORDER), encoding="utf-8")
    return lab


@pytest.mark.slow
def test_the_command_names_what_is_missing_then_writes_the_three_forms(lab: Lab, tmp_path: Path) -> None:
    out = tmp_path / "c.pdf"
    said = lab.run("certificate", SERIAL, "--out", str(out), "--by", "I. Issuer", status=2).stderr
    assert said.count("\n") == 1
    assert "customer's name" in said
    assert "[customer] of the order" in said
    assert not out.exists()
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("[customer]\nnome = 'x'\n", encoding="utf-8")
    refused = lab.run("certificate", SERIAL, "--out", str(out), "--order", str(wrong), status=2).stderr
    assert "wrong.toml: customer.nome" in refused
    issue = ("certificate", SERIAL, "--by", "I. Issuer", "--order", str(tmp_path / "order.toml"), "--out")
    answer = lab.json(*issue, str(out))
    assert answer["version"] == 1
    assert out.read_bytes().startswith(b"%PDF-1.7")
    for suffix, begins in (("xml", b"<?xml"), ("json", b'{"adjustment"'), ("pdf", b"%PDF")):
        again = tmp_path / f"again.{suffix}"
        said = lab.run("certificate", SERIAL, "--out", str(again)).stdout
        assert f"certificate {answer['number']} of {SERIAL} version 1" in said
        assert again.read_bytes().startswith(begins)
    assert (tmp_path / "again.pdf").read_bytes() == out.read_bytes()
    assert "give pdf, xml or json" in lab.run("certificate", SERIAL, "--out", "x.doc", status=2).stderr
    assert answer["number"] in lab.run("certificates", SERIAL).stdout


@pytest.mark.slow
def test_over_http_it_is_issued_fetched_and_listed(lab: Lab) -> None:
    with open_client(lab.database) as client:
        assert client.get(PATH).status_code == 404
        refused = client.post(PATH, json={"by": "I. Issuer"})
        assert (refused.status_code, refused.json()["type"]) == (400, "urn:labctl:problem:missing-facts")
        named = {"fact": "customer's name", "where": "[customer] of the order", "table": "customer", "key": "name"}
        assert {**named, "remedy": ""} in refused.json()["missing"]
        answer = client.post(PATH, json={"by": "I. Issuer", "order": ORDER})
        assert answer.status_code == 201, answer.text
        number = answer.json()["number"]
        file = client.get(PATH)
        assert file.headers["content-type"] == "application/pdf"
        assert f'filename="{number}.pdf"' in file.headers["content-disposition"]
        assert client.get(PATH, headers={"If-None-Match": file.headers["etag"]}).status_code == 304
        assert json.loads(client.get(PATH, params={"format": "json"}).content)["number"] == number
        assert client.get(PATH, params={"number": "ICL-1999-0001"}).status_code == 404
        other = client.post(PATH, json={"by": "I", "order": {**ORDER, "adjustment": "The connector was renewed."}})
        assert (other.status_code, other.json()["type"]) == (409, "urn:labctl:problem:certificate-refused")
        (row,) = client.get(f"{UNIT}/certificates").json()
        assert (row["number"], row["replaced_by"]) == (number, None)
