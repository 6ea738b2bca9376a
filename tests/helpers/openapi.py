"""The description of the HTTP interface, which needs no service."""

from __future__ import annotations

from functools import cache
from typing import Any

from fastapi.routing import iter_route_contexts

from labctl.api import create_app


@cache
def openapi_document() -> dict[str, Any]:
    """Return the OpenAPI document, made once in a process: 1.4 s of processor time. Only read it."""
    return create_app(None).openapi()


@cache
def operations() -> list[tuple[str, str]]:
    """Return method and path of every operation of the document, of a new one as soon as it is there.

    By the routes: each process that collects the tests would have to make the document for them.
    """
    described = (route for route in iter_route_contexts(create_app(None).routes) if route.include_in_schema)
    return sorted((method.lower(), route.path_format) for route in described for method in route.methods or ())
