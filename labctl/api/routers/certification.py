"""Certification of calibrations: assess, certify, revoke."""

from __future__ import annotations

from fastapi import APIRouter, Request

from labctl.api.access_policy import NEEDS_APPROVER
from labctl.api.computation import execute, while_connected
from labctl.api.dependencies import ServiceDep, command_route
from labctl.services.calibrations.assessment import assess
from labctl.services.calibrations.certification import list_certifications
from labctl.services.commands.registry import CERTIFY, REVOKE
from labctl.services.commands.requests import ToVersion
from labctl.services.schemas.certification import (
    AssessmentResponse,
    CertificationResponse,
    CertifyRequest,
    RevokeRequest,
)

router = APIRouter(prefix="/api/units/{serial}", tags=["calibrations"])


@router.get("/certifications", summary="Certifications and revocations")
def certifications(serial: str, service: ServiceDep) -> list[CertificationResponse]:
    """Every certification and revocation of a version of the unit, newest first: who, why, when, and until when."""
    return list_certifications(service.store, serial)


@router.get("/calibrations/{version}/assessment", summary="Objections to certifying a version")
async def assessment(request: Request, serial: str, version: int, service: ServiceDep) -> AssessmentResponse:
    """The verdict on the version from its own recording, its errors, and the objections that certifying it would
    override."""
    return await while_connected(request, service, assess, serial, version)


@command_route(router, CERTIFY, "Certify a version", dependencies=[NEEDS_APPROVER])
async def certify(serial: str, version: int, request: CertifyRequest, service: ServiceDep) -> CertificationResponse:
    """Put a version in force: who, why, and when the next calibration is due. An older version again is a rollback.

    The verdict is stored with the certification. 409 where there are objections, unless `override` is set and the
    reason is a sentence. Needs an approver's key.
    """
    return await execute(service, CERTIFY, ToVersion(serial, version, request))


@command_route(router, REVOKE, "Revoke a version", dependencies=[NEEDS_APPROVER])
def revoke(serial: str, version: int, request: RevokeRequest, service: ServiceDep) -> CertificationResponse:
    """Revoke the version; the unit then has no certified calibration. Needs an approver's key."""
    return service.execute(REVOKE, ToVersion(serial, version, request))
