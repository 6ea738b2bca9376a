"""Descriptions of the fields of typed dictionaries in the API's description, from the docstrings below the fields.

Models carry theirs as `Field(description=...)`. Typed dictionaries are read by programs that never load pydantic, so
each field has a docstring below it (PEP 257, attribute docstrings), which is looked up when the description is made.
"""

from __future__ import annotations

import ast
import inspect
import pkgutil
from importlib import import_module
from types import ModuleType
from typing import Any

from fastapi import FastAPI
from typing_extensions import get_original_bases, is_typeddict

from labctl import json_types


class DescribedAPI(FastAPI):
    """An application whose OpenAPI document describes the fields of typed dictionaries too."""

    def openapi(self) -> dict[str, Any]:
        """Return the OpenAPI document, made at the first call."""
        if self.openapi_schema is None:
            described = typed_dictionaries()
            for name, schema in super().openapi()["components"]["schemas"].items():
                fields = described.get(name, {})
                for key, field in schema.get("properties", {}).items():
                    if key in fields:
                        field.setdefault("description", fields[key])
        return super().openapi()


def typed_dictionaries() -> dict[str, dict[str, str]]:
    """Return name -> field -> description of the typed dictionaries of `labctl.json_types`."""
    found: dict[str, dict[str, str]] = {}
    for module in pkgutil.walk_packages(json_types.__path__, f"{json_types.__name__}."):
        found |= _described(import_module(module.name))
    return found


def _described(module: ModuleType) -> dict[str, dict[str, str]]:
    own = {
        node.name: _docstrings(node)
        for node in ast.parse(inspect.getsource(module)).body
        if isinstance(node, ast.ClassDef) and is_typeddict(getattr(module, node.name))
    }
    return {name: _with_inherited(getattr(module, name), own) for name in own}


def _with_inherited(kind: type, own: dict[str, dict[str, str]]) -> dict[str, str]:
    """Return the descriptions of a typed dictionary's own fields, and of those of its bases in the same module."""
    found: dict[str, str] = {}
    for base in get_original_bases(kind):
        if is_typeddict(base):
            found |= _with_inherited(base, own)
    return found | own.get(kind.__name__, {})


def _docstrings(node: ast.ClassDef) -> dict[str, str]:
    """Return field -> docstring of a class, in one line each."""
    found = {}
    for field, below in zip(node.body, node.body[1:], strict=False):
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(below, ast.Expr):
            found[field.target.id] = " ".join(str(ast.literal_eval(below.value)).split())
    return found
