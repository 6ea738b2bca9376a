"""Units, benches and the catalogue: what there is."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from labctl.api.dependencies import ServiceDep
from labctl.services.campaigns.bench_status import bench_statuses
from labctl.services.effects import catalogue
from labctl.services.recordings.units import list_units, unit
from labctl.services.schemas.benches import BenchStatus, ClearRequest
from labctl.services.schemas.recordings import UnitResponse

router = APIRouter(prefix="/api", tags=["what there is"])


@router.get("/units", summary="All units")
def units(service: ServiceDep) -> list[UnitResponse]:
    """Every unit that was measured or imported, by serial number."""
    return list_units(service.store)


@router.get("/units/{serial}", summary="One unit")
def one_unit(serial: str, service: ServiceDep) -> UnitResponse:
    """Who the unit is, its recordings and calibrations, and which version is in force."""
    return unit(service.store, serial)


@router.get("/benches", summary="This service's bench")
def benches(service: ServiceDep) -> list[dict[str, Any]]:
    """The bench that this service runs: its instruments, limits and what it is doing."""
    return service.benches()


@router.get("/benches/status", summary="What could not be confirmed safe")
def bench_states(service: ServiceDep) -> list[BenchStatus]:
    """Every bench of this database, with what its last safe state could not confirm."""
    return bench_statuses(service.store)


@router.post("/benches/{bench}/clear", summary="Say that a bench was looked at")
def clear(bench: str, request: ClearRequest, service: ServiceDep) -> BenchStatus:
    """Take in that a person has looked at a bench whose safe state was not confirmed; campaigns may start again."""
    return service.commands().clear_bench(bench, request)


@router.get("/effects", summary="The catalogue of physical effects")
def effects() -> dict[str, Any]:
    """Every effect a model can be made of: its standard term, sentence, origin, channels, coefficients and ranges."""
    return catalogue()
