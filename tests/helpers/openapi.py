"""The description of the HTTP interface, which needs no service."""

from __future__ import annotations

from functools import cache
from typing import Any

from labctl.api import create_app


@cache
def openapi_document() -> dict[str, Any]:
    """Return the OpenAPI document, made once in a process: 1.4 s of processor time. Only read it."""
    return create_app(None).openapi()


def operations() -> list[tuple[str, str]]:
    """Return method and path of every operation, of a new one as soon as it is there."""
    return sorted((method, path) for path, item in openapi_document()["paths"].items() for method in item)
