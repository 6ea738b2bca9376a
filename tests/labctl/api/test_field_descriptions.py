"""Every field of the HTTP interface is described where it is declared."""

from __future__ import annotations

import pkgutil
from functools import cache
from importlib import import_module
from typing import Any

import pytest
from pydantic import BaseModel
from typing_extensions import is_typeddict

from labctl import json_types
from labctl.api import create_app
from labctl.api.descriptions import typed_dictionaries

#: Packages of which every field has a description.
DESCRIBED = ("labctl.json_types",)


@cache
def properties() -> dict[tuple[str, str], dict[str, Any]]:
    """Return (schema, field) -> property of the OpenAPI document."""
    schemas = create_app(None).openapi()["components"]["schemas"]
    return {
        (name, field): found
        for name, schema in schemas.items()
        for field, found in schema.get("properties", {}).items()
    }


def declared_in(package: str) -> set[str]:
    """Return the names under which classes of a package may stand in the OpenAPI document."""
    folder = import_module(package)
    modules = [folder, *(import_module(each.name) for each in pkgutil.walk_packages(folder.__path__, f"{package}."))]
    kinds = {
        kind
        for module in modules
        for kind in vars(module).values()
        if isinstance(kind, type) and (is_typeddict(kind) or issubclass(kind, BaseModel))
    }
    own = {(kind.__module__, kind.__name__) for kind in kinds if f"{kind.__module__}.".startswith(f"{package}.")}
    names = {name for _, name in own} | {f"{module.replace('.', '__')}__{name}" for module, name in own}
    return names | {f"{name}-{direction}" for name in names for direction in ("Input", "Output")}


@pytest.mark.parametrize("package", DESCRIBED)
def test_every_field_of_the_openapi_document_is_described(package: str) -> None:
    names = declared_in(package)
    own = {where: found for where, found in properties().items() if where[0] in names}
    assert len(own) > 100
    missing = [f"{schema}.{field}" for (schema, field), found in own.items() if not found.get("description")]
    assert not missing, f"fields of {package} without a description: {', '.join(missing)}"


def test_every_field_of_a_typed_dictionary_is_described() -> None:
    described, missing = typed_dictionaries(), []
    for module in pkgutil.walk_packages(json_types.__path__, f"{json_types.__name__}."):
        for name, kind in vars(import_module(module.name)).items():
            if is_typeddict(kind):
                missing += [f"{name}.{field}" for field in kind.__annotations__ if field not in described[name]]
    assert not missing, f"fields without a docstring below them: {', '.join(missing)}"


def test_a_keyword_as_a_field_is_described_in_the_functional_syntax() -> None:
    assert properties()["FailingRange", "from"]["description"].endswith("in the unit of the channel.")


def test_an_inherited_field_is_described() -> None:
    assert properties()["CataloguedEffect", "id"]["description"]
