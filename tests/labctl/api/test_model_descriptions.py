"""Each field of the requests and responses says what it is, and in which unit."""

from __future__ import annotations

import importlib
import pkgutil
import re
from collections.abc import Iterable, Iterator

import pytest
from pydantic import BaseModel
from typing_extensions import is_typeddict

import labctl.json_types
import labctl.services.schemas
from instruments.laboratory import Contact, Laboratory
from labctl.api import create_app
from labctl.certificates.document import Customer
from labctl.recording.info import LeftOut, OutputUnit

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
    for name in modules("labctl.services.schemas", labctl.services.schemas.__path__):
        for value in vars(importlib.import_module(name)).values():
            if isinstance(value, type) and issubclass(value, BaseModel) and value.__module__ == name:
                found[value] = None
    return list(found)


def json_types() -> set[str]:
    """Return the names of the typed dictionaries of responses; their fields have docstrings."""
    return {
        name
        for module in modules("labctl.json_types", labctl.json_types.__path__)
        for name, value in vars(importlib.import_module(module)).items()
        if is_typeddict(value)
    }


@pytest.mark.parametrize("model", models(), ids=lambda model: f"{model.__module__}.{model.__name__}")
def test_each_field_of_a_model_has_a_description(model: type[BaseModel]) -> None:
    assert [name for name, field in model.model_fields.items() if not field.description] == []


@pytest.mark.parametrize("model", models(), ids=lambda model: f"{model.__module__}.{model.__name__}")
def test_a_field_named_with_a_unit_states_this_unit(model: type[BaseModel]) -> None:
    missing = {}
    for name, field in model.model_fields.items():
        suffix = max((end for end in UNITS if name.endswith(end)), key=len, default="")
        if suffix and not re.search(UNITS[suffix], field.description or ""):
            missing[name] = field.description
    assert missing == {}


def test_each_property_in_the_description_of_the_api_has_a_description() -> None:
    schemas = create_app(None).openapi()["components"]["schemas"]
    elsewhere = json_types()
    missing = [
        f"{name}.{key}"
        for name, schema in schemas.items()
        if re.sub(r"^.*__|-(Input|Output)$", "", name) not in elsewhere | OF_FASTAPI
        or name.startswith("labctl__recording__")
        for key, value in schema.get("properties", {}).items()
        if "description" not in value
    ]
    assert missing == []
