"""Each field of requests, responses and results says what it is, and in which unit."""

from __future__ import annotations

import importlib
import pkgutil
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from typing import Any

import pytest
from pydantic import BaseModel
from typing_extensions import is_typeddict

import labctl.answers
from instruments.laboratory import Contact, Laboratory
from labctl.answers.certificates import Customer
from labctl.answers.recording_head import LeftOut, OutputUnit
from labctl.api.descriptions import typed_dictionaries
from tests.helpers.openapi import openapi_document

#: Models of other packages that requests and responses contain.
ELSEWHERE: tuple[type[BaseModel], ...] = (Contact, Customer, Laboratory, LeftOut, OutputUnit)
#: Schemas of the document that FastAPI declares.
OF_FASTAPI = {"HTTPValidationError", "ValidationError"}
#: Ends of names that are units, and how a description writes them.
UNITS = {
    "_dps": r"deg/s", "_c": r"deg C", "_s": r"\bs\b", "_deg": r"\bdeg\b", "_hz": r"\bHz\b", "_ut": r"\buT\b",
    "_dps2": r"\(deg/s\)\^2", "_m_s2": r"m/s2", "_pct": r"%", "_hpa": r"hPa", "_per_min": r"deg/min",
}  # fmt: skip


def modules(package: str, path: Iterable[str]) -> Iterator[str]:
    """Yield the names of a package's modules."""
    return (each.name for each in pkgutil.walk_packages(path, f"{package}."))


def models() -> list[type[BaseModel]]:
    """Return the models of requests and responses, each once."""
    found = dict.fromkeys(ELSEWHERE)
    for name in modules("labctl.answers", labctl.answers.__path__):
        for value in vars(importlib.import_module(name)).values():
            if isinstance(value, type) and issubclass(value, BaseModel) and value.__module__ == name:
                found[value] = None
    return list(found)


def typed_dicts() -> list[type]:
    """Return the typed dictionaries of results, each once."""
    found = dict.fromkeys(
        kind
        for name in modules("labctl.answers", labctl.answers.__path__)
        for kind in vars(importlib.import_module(name)).values()
        if is_typeddict(kind) and kind.__module__ == name
    )
    return list(found)


def without_unit(described: Mapping[str, str | None]) -> dict[str, str | None]:
    """Return field -> description of the fields that a name gives a unit, and whose description does not state it."""
    missing = {}
    for name, description in described.items():
        suffix = max((end for end in UNITS if name.endswith(end)), key=len, default="")
        if suffix and not re.search(UNITS[suffix], description or ""):
            missing[name] = description
    return missing


@pytest.mark.parametrize("model", models(), ids=lambda model: f"{model.__module__}.{model.__name__}")
def test_each_field_of_a_model_has_a_description(model: type[BaseModel]) -> None:
    assert [name for name, field in model.model_fields.items() if not field.description] == []


@pytest.mark.parametrize("model", models(), ids=lambda model: f"{model.__module__}.{model.__name__}")
def test_a_field_named_with_a_unit_states_this_unit(model: type[BaseModel]) -> None:
    assert without_unit({name: field.description for name, field in model.model_fields.items()}) == {}


@cache
def described_dictionaries() -> Mapping[str, Mapping[str, str]]:
    """Return the docstrings of the fields of every typed dictionary."""
    return typed_dictionaries()


@pytest.mark.parametrize("kind", typed_dicts(), ids=lambda kind: f"{kind.__module__}.{kind.__name__}")
def test_each_field_of_a_typed_dictionary_has_a_docstring_with_its_unit(kind: type) -> None:
    described = described_dictionaries()[kind.__name__]
    assert [name for name in kind.__annotations__ if name not in described] == []
    assert without_unit(described) == {}


@cache
def properties() -> dict[tuple[str, str], dict[str, Any]]:
    """Return (schema, field) -> property of the OpenAPI document."""
    schemas = openapi_document()["components"]["schemas"]
    return {
        (name, key): value
        for name, schema in schemas.items()
        if name not in OF_FASTAPI
        for key, value in schema.get("properties", {}).items()
    }


@pytest.mark.slow
def test_each_property_in_the_description_of_the_api_has_a_description() -> None:
    assert [f"{name}.{key}" for (name, key), value in properties().items() if "description" not in value] == []


def test_fields_of_typed_dictionaries_are_described_by_their_docstrings() -> None:
    described = properties()
    assert described["Suspect", "effect"]["description"] == "Id of the effect."
    assert described["FailingRange", "from"]["description"].endswith("in the unit of the channel.")  # a keyword
    assert described["CataloguedEffect", "id"]["description"].startswith("Id by which")  # inherited
    assert described["LeftOutEffect", "effect"]["description"] == "Id of the effect."
