"""Certificates of calibrations: issue one, fetch one as it was issued, list those of a unit."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Header, Query, Response

from labctl.api.access_policy import NEEDS_APPROVER
from labctl.api.computation import execute
from labctl.api.dependencies import ServiceDep, command_route
from labctl.services.certificates.served import certificate_file, list_certificates
from labctl.services.commands.registry import ISSUE_CERTIFICATE
from labctl.services.commands.requests import ToVersion
from labctl.services.schemas.documents.certificates import CertificateRequest, CertificateResponse

router = APIRouter(prefix="/api/units/{serial}", tags=["certificates"])


@router.get("/certificates", summary="Certificates of a unit")
def certificates(serial: str, service: ServiceDep) -> list[CertificateResponse]:
    """Every certificate of the unit, newest first, with what it replaces and what replaces it."""
    return list_certificates(service.store, serial)


@command_route(router, ISSUE_CERTIFICATE, "Issue a certificate", dependencies=[NEEDS_APPROVER])
async def issue(serial: str, version: int, request: CertificateRequest, service: ServiceDep) -> CertificateResponse:
    """Issue the certificate of the version from stored facts and those of the order; one that was issued is answered.

    400 with `missing` where mandatory facts are missing: each one, and where to state it. 409 for a revoked version, a
    reference standard past its due date, and other facts than those of the one that was issued, unless `amend` says
    why it is replaced. Needs an approver's key.
    """
    return await execute(service, ISSUE_CERTIFICATE, ToVersion(serial, version, request))


@router.get("/calibrations/{version}/certificate", summary="A certificate as it was issued", response_class=Response)
def certificate(
    serial: str,
    version: int,
    service: ServiceDep,
    format: Annotated[  # noqa: A002
        str, Query(description="Format of the certificate: pdf (PDF/A-3), xml (DCC 3.3.0) or json.")
    ] = "pdf",
    number: Annotated[
        str | None, Query(description="Number of a certificate of the version; default: the valid certificate.")
    ] = None,
    if_none_match: Annotated[str | None, Header()] = None,
) -> Response:
    """The certificate as a file, always the same bytes; the ETag is the hash of its JSON and the format."""
    file = certificate_file(service.store, serial, version, format, number)
    headers = {"ETag": f'"{file.etag}"', "Content-Disposition": f'inline; filename="{file.name}"'}
    if if_none_match and headers["ETag"] in if_none_match:
        return Response(status_code=304, headers=headers)
    return Response(file.content, media_type=file.media_type, headers=headers)
