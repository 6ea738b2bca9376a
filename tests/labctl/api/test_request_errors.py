"""Errors of a request in words: the place, the value, the limit, and what to do; no pattern and no name of a type."""

from __future__ import annotations

from typing import Any

import pytest
from fastapi.testclient import TestClient

from labctl.api import create_app

CERTIFICATE = "/api/units/FOG-0001/calibrations/1/certificate"
CONFORMITY = {"specification": "VW-77", "rule": "simple"}


@pytest.fixture(scope="module")
def client() -> TestClient:
    """Return a client of a service whose requests are examined, and never carried out."""
    return TestClient(create_app(None))


def errors_of(client: TestClient, body: dict[str, Any]) -> dict[str, str]:
    answer = client.post(CERTIFICATE, json={"by": "I. Issuer", **body})
    assert answer.status_code == 422, answer.text
    problem = answer.json()
    for each in problem["errors"]:
        assert f"{'.'.join(each['place'])}: {each['text']}" in problem["detail"]
    return {".".join(each["place"]): each["text"] for each in problem["errors"]}


@pytest.mark.parametrize("country", ["Germany", "de", "DEU"])
def test_a_country_is_asked_for_by_its_letters(client: TestClient, country: str) -> None:
    found = errors_of(client, {"order": {"customer": {"country": country}}})
    assert list(found) == ["body.order.customer.country"]
    text = found["body.order.customer.country"]
    assert repr(country) in text
    assert "two capital letters" in text
    assert "[A-Z]" not in text


def test_a_long_text_is_cut_and_its_limit_is_named(client: TestClient) -> None:
    found = errors_of(client, {"order": {"customer": {"name": "a" * 5000}, "item": {"manufacturer": "b" * 5000}}})
    assert "one line of at most 300 characters" in found["body.order.customer.name"]
    assert "(5000 characters); give at most 300" in found["body.order.item.manufacturer"]
    assert all(len(text) < 200 for text in found.values())


@pytest.mark.parametrize(
    ("limit", "said"),
    [
        ("abc", "'abc' is not a number"),
        ("0,1", "with a point, such as 0.1"),
        (-1, "-1 is out of range; give more than 0"),
    ],
)
def test_a_limit_is_a_number_above_nothing(client: TestClient, limit: object, said: str) -> None:
    found = errors_of(client, {"order": {"conformity": {**CONFORMITY, "limit_dps": limit}}})
    assert said in found["body.order.conformity.limit_dps"]


def test_what_is_absent_unknown_or_no_choice_is_said(client: TestClient) -> None:
    found = errors_of(
        client,
        {"order": {"conformity": {"limit_dps": 1, "specification": "A", "rule": "strict"}, "item": {"received": "now"},
                   "colour": "red", "external": 7}},
    )  # fmt: skip
    assert "'strict' is none of the choices; give 'simple' or 'guard-band'" in found["body.order.conformity.rule"]
    assert "'now' is not a date; write it as 2026-01-31" in found["body.order.item.received"]
    assert found["body.order.colour"] == "this key is not known; leave it out"
    assert found["body.order.external"] == "7 is not a text; give a text"


def test_more_errors_than_an_answer_lists_are_counted(client: TestClient) -> None:
    answer = client.post(CERTIFICATE, json={"by": "I", "order": {f"key_{k}": 1 for k in range(60)}})
    assert len(answer.json()["errors"]) == 50
    assert answer.json()["detail"].endswith("; and 55 more")
