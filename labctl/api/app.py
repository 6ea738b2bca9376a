"""The application: routers, problem documents, health and figures."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from importlib.metadata import version

from fastapi import FastAPI

from labctl.api import calibrations, campaigns, health, problems, recordings, schedule, units
from labctl.services.house import House

DESCRIPTION = """
Calibrations of gyroscopes by serial number, the campaigns that measured them, and the recordings behind them.

* `GET /api/units/{serial}/calibration` is what a robot loads: the certified calibration, immutable bytes with a strong
  ETag, as JSON or in the format of a consumer.
* `POST /api/recordings` takes data measured on any bench; `POST /api/units/{serial}/calibrations` fits it.
* `POST /api/campaigns` runs a recipe on this service's bench, now, at a time or on a cron line;
  `GET /api/campaigns/{id}/events` follows it, `GET /api/schedule` says what begins when.

Rates are deg/s, temperatures deg C, times s, instants UTC. Errors are problem documents (RFC 9457).
"""


def create_app(house: House) -> FastAPI:
    """Make the HTTP application of a house; closing the application closes the house, bench left safe."""

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        house.start()
        try:
            yield
        finally:
            house.close()

    app = FastAPI(title="labctl", version=version("labctl"), description=DESCRIPTION, lifespan=lifespan)
    app.state.house = house
    problems.install(app)
    for router in (
        health.router,
        units.router,
        calibrations.router,
        campaigns.router,
        schedule.router,
        recordings.router,
    ):
        app.include_router(router)
    return app
