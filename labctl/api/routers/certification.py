"""Certification of calibrations: assess, certify, release, revoke."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import JSONResponse

from labctl.answers.certification import (
    AssessmentResponse,
    CertificationResponse,
    CertifyRequest,
    ReleaseRequest,
    ReleaseRequestResponse,
    RevokeRequest,
)
from labctl.api.access_policy import NEEDS_APPROVER
from labctl.api.computation import execute, while_connected
from labctl.api.dependencies import ServiceDep, command_route
from labctl.services.calibrations.assessment import assess
from labctl.services.calibrations.certification import list_certifications
from labctl.services.calibrations.release import list_waiting
from labctl.services.commands.registry import CERTIFY, RELEASE, REVOKE
from labctl.services.commands.requests import ToVersion

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


@router.get("/release-requests", summary="Versions that wait for a second person")
def release_requests(serial: str, service: ServiceDep) -> list[ReleaseRequestResponse]:
    """Versions that a first person asked to certify, and that a second one has to release, newest first."""
    return list_waiting(service.store, serial)


@command_route(
    router, CERTIFY, "Certify a version", dependencies=[NEEDS_APPROVER], response_model=CertificationResponse
)
async def certify(
    serial: str, version: int, request: CertifyRequest, service: ServiceDep
) -> CertificationResponse | JSONResponse:
    """Put a version in force: who, why, and when the next calibration is due. An older version again is a rollback.

    The verdict is stored with the certification. 409 where there are objections, unless `override` is set and the
    reason is a sentence. Where two persons have to agree ($LABCTL_TWO_PERSON_RELEASE): 202, nothing is in force until
    another key releases it. Needs an approver's key.
    """
    answer = await execute(service, CERTIFY, ToVersion(serial, version, request))
    if isinstance(answer, ReleaseRequestResponse):
        return JSONResponse(answer.model_dump(mode="json"), CERTIFY.status_of(answer))
    return answer


@command_route(router, RELEASE, "Release a version as the second person", dependencies=[NEEDS_APPROVER])
async def release(serial: str, version: int, request: ReleaseRequest, service: ServiceDep) -> CertificationResponse:
    """Put in force what a first person asked to certify. What is known of the version is assessed again.

    404 where nothing waits, 409 for the key that asked. Needs an approver's key.
    """
    return await execute(service, RELEASE, ToVersion(serial, version, request))


@command_route(router, REVOKE, "Revoke a version", dependencies=[NEEDS_APPROVER])
def revoke(serial: str, version: int, request: RevokeRequest, service: ServiceDep) -> CertificationResponse:
    """Revoke the version, and withdraw its certificates; the unit then has no certified calibration.

    The answer names the certificates, and who fetched the version and has to be notified. Needs an approver's key.
    """
    return service.execute(REVOKE, ToVersion(serial, version, request))
