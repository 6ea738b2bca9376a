"""The application: routers, problem documents, health and figures."""

from __future__ import annotations

import ast
import inspect
import pkgutil
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import cache
from importlib import import_module
from importlib.metadata import version
from typing import Any, get_type_hints

from fastapi import APIRouter, FastAPI
from starlette.routing import BaseRoute
from typing_extensions import Doc, get_original_bases, is_typeddict

from labctl import json_types, web
from labctl.api import problems
from labctl.api.access_policy import DECLARES_KEY, AccessPolicy
from labctl.api.dependencies import ControlPool
from labctl.api.middleware import AccessMiddleware
from labctl.api.request_log import RequestFigures, RequestLogMiddleware
from labctl.api.routers import (
    admin,
    benches,
    calibrations,
    campaigns,
    certificates,
    certification,
    effects,
    health,
    live,
    motions,
    plans,
    recordings,
    schedule,
    sensors,
    standards,
    swagger_ui,
    units,
    validity,
)  # fmt: skip
from labctl.services.admin.key_memory import KeyMemory
from labctl.services.lab_service import LabService

# Descriptions of the fields of typed dictionaries in the API's description, from the docstrings below the fields.
#
# Models carry theirs as `Field(description=...)`. Typed dictionaries are read by programs that never load pydantic, so
# each field has a docstring below it (PEP 257, attribute docstrings), which is read when the description is made.
# A field named like a keyword, which only the functional syntax can have, carries it as `Annotated[..., Doc(...)]`.


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
    """Return name -> field -> description of the typed dictionaries of `labctl.json_types`.

    Each is there under its name and under the one that an OpenAPI document gives it where two classes share a name.
    """
    kinds: dict[str, type] = {}
    own: dict[str, dict[str, str]] = {}
    for found in pkgutil.walk_packages(json_types.__path__, f"{json_types.__name__}."):
        module = import_module(found.name)
        classes = {
            node.name: node for node in ast.parse(inspect.getsource(module)).body if isinstance(node, ast.ClassDef)
        }
        for name, kind in vars(module).items():
            if is_typeddict(kind) and kind.__module__ == module.__name__:
                kinds[name] = kind
                own[name] = _docstrings(classes[name]) if name in classes else _docs(kind)
    described = {name: _with_inherited(kind, own) for name, kind in kinds.items()}
    return described | {f"{kinds[name].__module__.replace('.', '__')}__{name}": described[name] for name in described}


def _docs(kind: type) -> dict[str, str]:
    """Return field -> text of the `Doc` of a typed dictionary in the functional syntax."""
    return {
        field: text.documentation
        for field, hint in get_type_hints(kind, include_extras=True).items()
        for text in getattr(hint, "__metadata__", ())
        if isinstance(text, Doc)
    }


def _with_inherited(kind: type, own: dict[str, dict[str, str]]) -> dict[str, str]:
    """Return the descriptions of a typed dictionary's own fields, and of those of its bases."""
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


DESCRIPTION = """
Calibrations of gyroscopes by serial number, the campaigns that measured them, and the recordings behind them.

* `GET /api/units/{serial}/calibration` is what a robot loads: the certified calibration, immutable bytes with a strong
  ETag, as JSON or in the format of a consumer.
* `POST /api/recordings` imports data measured on any bench; `POST /api/units/{serial}/calibrations` fits it.
* `POST /api/campaigns` runs a recipe on this service's bench, now, at a time or on a cron line;
  `GET /api/campaigns/{id}/events` follows it, `GET /api/schedule` lists the scheduled starts.
* `POST /api/live/start` calibrates a unit while a person turns it; `GET /api/live/events` follows it.

Rates are deg/s, temperatures deg C, times s, instants UTC. Errors are problem documents (RFC 9457).
Where keys are required, they are sent as `Authorization: Bearer`: reading needs a viewer's, every change an operator's,
certifying and keys for an approver's.
"""


#: In the order of the API's description, in which they are also asked: what is read most comes first.
ROUTERS = (
    calibrations, certification, health, units, benches, effects, certificates, plans,
    campaigns, schedule, live, recordings, motions, sensors, standards, validity, admin, swagger_ui,
)  # fmt: skip
#: Which of their routes take a key; every route of the others does.
SAY_THEMSELVES = (health, swagger_ui)
#: The parser's own bound on parts of a form: a recording has at most three files.
MOST_FILES = 4


@cache
def api_routes() -> tuple[BaseRoute, ...]:
    """Return the routes of the API, described once for all applications of this process: 0.15 s.

    They hold nothing of an application: each takes the service from the application of its request.
    """
    described = APIRouter()
    for each in ROUTERS:
        described.include_router(each.router, dependencies=[] if each in SAY_THEMSELVES else [DECLARES_KEY])
    return tuple(described.routes)


def create_app(service: LabService, access: AccessPolicy | None = None, keys: KeyMemory | None = None) -> FastAPI:
    """Make the HTTP application of a service; closing the application closes the service, bench left safe.

    `keys` are the keys in force from memory, by which stops are admitted.
    """

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        service.start()
        app.state.control_pool = ControlPool()
        try:
            yield
        finally:
            service.close()
            app.state.control_pool.close()

    app = DescribedAPI(
        title="labctl",
        version=version("labctl"),
        description=DESCRIPTION,
        lifespan=lifespan,
        docs_url=None,  # the framework's own pages load their scripts from outside
        redoc_url=None,
        form_limits={"max_files": MOST_FILES, "max_fields": MOST_FILES},
    )
    app.state.service = service
    problems.install(app)
    app.router.routes.extend(api_routes())
    web.install(app)
    app.add_middleware(AccessMiddleware, service=service, access=access or AccessPolicy(), keys=keys)
    app.state.request_figures = RequestFigures()
    app.add_middleware(RequestLogMiddleware, figures=app.state.request_figures)
    return app
