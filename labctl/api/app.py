"""The application: routers, problem documents, health and figures."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import cache
from importlib.metadata import version

from fastapi import APIRouter, FastAPI
from starlette.routing import BaseRoute

from labctl import web
from labctl.api import problems
from labctl.api.access_policy import DECLARES_KEY, AccessPolicy
from labctl.api.calibration_answer import InForceMiddleware
from labctl.api.compression import CompressionMiddleware
from labctl.api.dependencies import ControlPool
from labctl.api.descriptions import DescribedAPI
from labctl.api.known_recording import NotModified, answer_not_modified
from labctl.api.middleware import AccessMiddleware
from labctl.api.request_log import RequestFigures, RequestLogMiddleware
from labctl.api.routers import (
    admin,
    benches,
    calibrations,
    campaigns,
    certificates,
    certification,
    diagnoses,
    effects,
    fleet,
    health,
    live,
    motions,
    plans,
    points,
    recordings,
    schedule,
    sensors,
    standards,
    swagger_ui,
    units,
    validity,
)  # fmt: skip
from labctl.api.validators import ValidatorMiddleware
from labctl.services.admin.key_memory import KeyMemory
from labctl.services.lab_service import LabService

DESCRIPTION = """
Calibrations of gyroscopes by serial number, the campaigns that measured them, and the recordings behind them.

* `GET /api/units/{serial}/calibration` is what a robot loads: the certified calibration, immutable bytes with a strong
  ETag, as JSON or in the format of a consumer.
* `POST /api/recordings` imports data measured on any bench; `POST /api/units/{serial}/calibrations` fits it.
* `POST /api/campaigns` runs a recipe on this service's bench, now, at a time or on a cron line;
  `GET /api/campaigns/{id}/events` follows it, `GET /api/schedule` lists the scheduled starts.
* `POST /api/units/{serial}/diagnoses` runs experiments until one missing effect is left.
* `POST /api/fleet/jobs` fits or criticises many units; `GET /api/fleet/report` says what they have in common.
* `POST /api/live/start` calibrates a unit while a person turns it; `GET /api/live/events` follows it.

Rates are deg/s, temperatures deg C, times s, instants UTC. Errors are problem documents (RFC 9457).
Where keys are required, they are sent as `Authorization: Bearer`: reading needs a viewer's, every change an operator's,
certifying and keys for an approver's.
"""


#: In the order of the API's description, in which they are also asked: what is read most comes first.
ROUTERS = (
    calibrations, certification, health, units, benches, effects, certificates, plans,
    campaigns, schedule, diagnoses, fleet, live, recordings, motions, points, sensors, standards, validity, admin,
    swagger_ui,
)  # fmt: skip
#: Which of their routes take a key; every route of the others does.
SAY_THEMSELVES = (health, swagger_ui)
#: The parser's own bound on parts of a form: a recording has at most three files.
MAX_FILES = 4


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
        telemetry={"tracing": False, "metrics": False, "logs": False},  # labctl has its own: /metrics and the log
        form_limits={"max_files": MAX_FILES, "max_fields": MAX_FILES},
    )
    app.state.service = service
    problems.install(app)
    app.add_exception_handler(NotModified, answer_not_modified)
    app.router.routes.extend(api_routes())
    web.install(app)
    app.add_middleware(ValidatorMiddleware)  # tags the document, whatever coding it travels in
    app.add_middleware(CompressionMiddleware)
    app.add_middleware(InForceMiddleware, service=service)
    app.add_middleware(AccessMiddleware, service=service, access=access or AccessPolicy(), keys=keys)
    app.state.request_figures = RequestFigures()
    app.add_middleware(RequestLogMiddleware, figures=app.state.request_figures)
    return app
