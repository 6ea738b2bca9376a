"""Descriptions of the fields of typed dictionaries in the API's description, from the docstrings below the fields.

Models carry theirs as `Field(description=...)`. Typed dictionaries are read by programs that never load pydantic, so
each field has a docstring below it (PEP 257, attribute docstrings), which is read when the description is asked for.
Fields whose names are keywords, which only the functional syntax can have, carry theirs as `Annotated[..., Doc(...)]`.
"""

from __future__ import annotations

import ast
import inspect
import pkgutil
from importlib import import_module
from typing import Any, get_type_hints

from fastapi import FastAPI
from typing_extensions import Doc, get_original_bases, is_typeddict

from labctl import answers


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
    """Return name -> field -> description of the typed dictionaries of `labctl.answers`.

    Each is there under its name and under the one that an OpenAPI document gives it where two classes share a name.
    """
    kinds: dict[str, type] = {}
    own_fields: dict[str, dict[str, str]] = {}
    for info in pkgutil.walk_packages(answers.__path__, f"{answers.__name__}."):
        module = import_module(info.name)
        classes = {
            node.name: node for node in ast.parse(inspect.getsource(module)).body if isinstance(node, ast.ClassDef)
        }
        for name, kind in vars(module).items():
            if is_typeddict(kind) and kind.__module__ == module.__name__:
                kinds[name] = kind
                own_fields[name] = _docstrings(classes[name]) if name in classes else _docs(kind)
    described = {name: _with_inherited(kind, own_fields) for name, kind in kinds.items()}
    return described | {f"{kinds[name].__module__.replace('.', '__')}__{name}": described[name] for name in described}


def _docs(kind: type) -> dict[str, str]:
    """Return field -> text of the `Doc` of a typed dictionary in the functional syntax."""
    return {
        field: text.documentation
        for field, hint in get_type_hints(kind, include_extras=True).items()
        for text in getattr(hint, "__metadata__", ())
        if isinstance(text, Doc)
    }


def _with_inherited(kind: type, own_fields: dict[str, dict[str, str]]) -> dict[str, str]:
    """Return the descriptions of a typed dictionary's own fields, and of those of its bases."""
    descriptions: dict[str, str] = {}
    for base in get_original_bases(kind):
        if is_typeddict(base):
            descriptions |= _with_inherited(base, own_fields)
    return descriptions | own_fields.get(kind.__name__, {})


def _docstrings(node: ast.ClassDef) -> dict[str, str]:
    """Return field -> docstring of a class, in one line each."""
    docstrings = {}
    for field, below in zip(node.body, node.body[1:], strict=False):
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(below, ast.Expr):
            docstrings[field.target.id] = " ".join(str(ast.literal_eval(below.value)).split())
    return docstrings
