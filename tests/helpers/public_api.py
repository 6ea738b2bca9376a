"""The public API as text: every exported name with its signature, its public members and theirs.

`python -m tests.helpers.public_api` writes it to tests/labctl/public_api.json, after a change that is wanted.
"""

from __future__ import annotations

import importlib
import inspect
import json
from typing import Any

from pydantic import BaseModel

from tests.helpers.paths import ROOT

MODULES = ("labctl.calibration", "labctl.client", "labctl.compensator", "labctl.fitting", "labctl.recording")
FILE = ROOT / "tests" / "labctl" / "public_api.json"


def signature(value: object) -> str:
    """Return a function's or a class's signature as it is written, or what else the value is."""
    if isinstance(value, type) and issubclass(value, Exception):
        return "(" + ", ".join(base.__name__ for base in value.__bases__) + ")"
    if inspect.isfunction(value) or isinstance(value, type):
        return str(inspect.signature(value))
    return type(value).__name__


def members(kind: type) -> dict[str, str]:
    """Return the public members of a class that labctl defines, by name: signature, or what kind of member it is."""
    if issubclass(kind, BaseModel):
        return {"fields": " ".join(sorted(kind.model_fields))}
    own = {name: value for base in reversed(kind.__mro__) if _is_ours(base) for name, value in vars(base).items()}
    found = {"": signature(kind)} | {name: _member(value) for name, value in own.items() if not name.startswith("_")}
    return dict(sorted(found.items()))


def public_api() -> dict[str, dict[str, Any]]:
    """Return every name of every public module."""
    return {name: _names(importlib.import_module(name)) for name in MODULES}


def _names(module: Any) -> dict[str, Any]:
    named = {name: getattr(module, name) for name in sorted(module.__all__)}
    return {name: members(value) if isinstance(value, type) else signature(value) for name, value in named.items()}


def _member(value: object) -> str:
    if isinstance(value, classmethod | staticmethod):
        return f"{type(value).__name__} {signature(value.__func__)}"
    return signature(value)


def _is_ours(base: type) -> bool:
    return base.__module__.startswith(("labctl.", "instruments.", "procedures."))


if __name__ == "__main__":
    FILE.write_text(json.dumps(public_api(), indent=1) + "\n", encoding="utf-8")
