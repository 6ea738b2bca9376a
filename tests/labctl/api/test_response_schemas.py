"""The description of the API says what every route answers: no schema is empty or free without a stated reason."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from tests.helpers.openapi import openapi_document, operations

#: Routes whose answer is no JSON: what it is.
FILES = {
    "GET /api/units/{serial}/calibration": "a calibration file: the document, or C, in a consumer's format",
    "GET /api/units/{serial}/calibrations/{version}/certificate": "a PDF, or a DCC, as issued; the JSON has a schema",
    "GET /api/recordings/{recording}/file": "a zip",
    "GET /api/units/{serial}/sensors/{sensor}/file": "a file in a consumer's format",
    "POST /api/backups": "nothing (204)",
}
#: Values of any JSON kind: whose form they have.
FREE = {
    "AuditResponse.detail": "the keys depend on the act",
    "Experiment.recipe": "a recipe as in its TOML; RecipeResponse.text is the form to rely on",
    "LogPreview.column_map": "a map as in its TOML; LogPreview.map_toml is the form to rely on",
    "PictureResponse.figure": "Plotly's own form",
    "RecordingAlone.info": "recording.toml as it was imported, with keys of other benches",
    "RecordingWithPoints.info": "as of RecordingAlone",
}


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    return openapi_document()


def answers(document: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any] | None]]:
    """Yield every route with the schema of each success; None where it declares none."""
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            for status, answer in operation["responses"].items():
                if status.startswith("2"):
                    contents = list(answer.get("content", {}).values()) or [{}]
                    yield from ((f"{method.upper()} {path}", content.get("schema")) for content in contents)


def test_the_operations_by_the_routes_are_those_of_the_document(document: dict[str, Any]) -> None:
    described = [(method, path) for path, item in document["paths"].items() for method in item]
    assert operations() == sorted(described)


def free_places(schema: object, schemas: dict[str, Any], at: str, seen: set[str]) -> Iterator[str]:
    """Yield where a schema says nothing of a value: empty, any JSON value, an object of no declared keys or values."""
    if isinstance(schema, list):
        for part in schema:
            yield from free_places(part, schemas, at, seen)
        return
    if not isinstance(schema, dict):
        return
    name = str(schema.get("$ref", "")).rpartition("/")[2]
    if name == "JsonValue" or _says_nothing(schema):
        yield at
    elif name and name not in seen:
        seen.add(name)
        yield from free_places(schemas[name], schemas, name, seen)
    for key, value in schema.get("properties", {}).items():
        yield from free_places(value, schemas, f"{at}.{key}", seen)
    for word in ("items", "prefixItems", "anyOf", "oneOf", "allOf", "additionalProperties"):
        if word in schema:
            yield from free_places(schema[word], schemas, at, seen)


def _says_nothing(schema: dict[str, Any]) -> bool:
    if schema.get("additionalProperties") is True:
        return True
    if schema.get("type") == "object":
        return "properties" not in schema and "additionalProperties" not in schema
    if schema.get("type") == "array":
        return "items" not in schema and "prefixItems" not in schema
    return not schema.keys() & {"$ref", "type", "anyOf", "oneOf", "allOf", "enum", "const"}


def test_every_answer_has_a_schema(document: dict[str, Any]) -> None:
    without = {route for route, schema in answers(document) if schema is None}
    assert without == set(FILES)


def test_no_value_of_an_answer_is_free_without_a_reason(document: dict[str, Any]) -> None:
    schemas, seen = document["components"]["schemas"], set[str]()
    found = {
        place for route, schema in answers(document) if schema for place in free_places(schema, schemas, route, seen)
    }
    assert found == set(FREE)


@pytest.mark.parametrize(
    "schema",
    [{}, {"title": "Detail"}, {"type": "object"}, {"type": "object", "additionalProperties": True}, {"type": "array"}],
)
def test_a_free_value_is_seen(schema: dict[str, Any]) -> None:
    around = {
        "type": "object",
        "properties": {"good": {"type": "string"}, "bad": {"anyOf": [schema, {"type": "null"}]}},
    }
    assert list(free_places(around, {}, "Answer", set())) == ["Answer.bad"]


@pytest.mark.parametrize("schema", [{"type": "string"}, {"type": "object", "additionalProperties": {"type": "number"}}])
def test_a_declared_value_is_not(schema: dict[str, Any]) -> None:
    assert not list(free_places(schema, {}, "Answer", set()))


def test_keys_that_are_always_there_are_required_and_those_that_may_be_absent_are_not(document: dict[str, Any]) -> None:
    schemas = document["components"]["schemas"]
    for name in ("CampaignResponse", "CriticismResponse", "ImproveResponse", "BenchResponse"):
        assert set(schemas[name]["required"]) == set(schemas[name]["properties"]), name
    assert set(schemas["ChannelLine"]["properties"]) - set(schemas["ChannelLine"]["required"]) == {"position"}
    assert "required" not in schemas["Views"]
    assert "required" not in schemas["PlanRequest"] or "clip" not in schemas["PlanRequest"]["required"]
