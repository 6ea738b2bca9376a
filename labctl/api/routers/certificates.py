"""Certificates of calibrations: issue, fetch as issued, list, withdraw, and ask for the state of one."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Header, Query, Request, Response

from labctl.answers.certificates import (
    CertificateRequest,
    CertificateResponse,
    MissingFactResponse,
    PublicCertificate,
    WithdrawRequest,
)
from labctl.api.access_policy import NEEDS_APPROVER
from labctl.api.computation import execute, while_connected
from labctl.api.dependencies import ServiceDep, command_route
from labctl.services.certificates.issue import missing_facts
from labctl.services.certificates.served import certificate_file, public_certificate
from labctl.services.certificates.states import list_certificates
from labctl.services.commands.registry import ISSUE_CERTIFICATE, WITHDRAW_CERTIFICATE
from labctl.services.commands.requests import ToVersion

router = APIRouter(tags=["certificates"])
UNIT = "/api/units/{serial}"


@router.get("/api/certificates/state", summary="State of a certificate")
def state(
    service: ServiceDep,
    number: Annotated[str, Query(max_length=100, description="Number of the certificate.")],
    calibration: Annotated[
        str,
        Query(
            max_length=64,
            description="Hash of the calibration as printed on the certificate, or its first 16 digits or more.",
        ),
    ],
) -> PublicCertificate:
    """Whether a certificate is valid, amended, superseded or withdrawn, since when and why, and what replaces it.

    Needs no key: who knows both number and hash has the certificate. 404 where they do not belong together. It is what
    the page behind the QR code shows.
    """
    return public_certificate(service.store, number, calibration)


@command_route(router, WITHDRAW_CERTIFICATE, "Withdraw a certificate", dependencies=[NEEDS_APPROVER])
def withdraw(request: WithdrawRequest, service: ServiceDep) -> CertificateResponse:
    """Withdraw one certificate; the version stays in force. Its files are still served, with `X-Labctl-Withdrawn`.

    Callers that fetch the calibration are notified too, until the version is certified again. 409 for a certificate
    that is withdrawn already. Needs an approver's key.
    """
    return service.execute(WITHDRAW_CERTIFICATE, request)


@router.get(UNIT + "/certificates", summary="Certificates of a unit")
def certificates(serial: str, service: ServiceDep) -> list[CertificateResponse]:
    """Every certificate of the unit, newest first, with its state, what it replaces and what replaces it."""
    return list_certificates(service.store, serial)


@command_route(router, ISSUE_CERTIFICATE, "Issue a certificate", dependencies=[NEEDS_APPROVER])
async def issue(serial: str, version: int, request: CertificateRequest, service: ServiceDep) -> CertificateResponse:
    """Issue the certificate of the version from stored facts and those of the order; one that was issued is answered.

    400 with `missing` where mandatory facts are missing: each one, where to state it, and the table of the order that
    can state it (null: none can). 409 for a revoked version, a
    reference standard past its due date, and other facts than those of the one that was issued, unless `amend` says
    why it is replaced. Needs an approver's key.
    """
    return await execute(service, ISSUE_CERTIFICATE, ToVersion(serial, version, request))


@router.get(UNIT + "/calibrations/{version}/certificate/missing", summary="What an order has to state")
async def missing(request: Request, serial: str, version: int, service: ServiceDep) -> list[MissingFactResponse]:
    """Each mandatory fact that the version and its readings do not state.

    A form asks for those that a table of the order can state; no certificate can be issued while another is missing,
    and its `remedy` says what to do.
    """
    return await while_connected(request, service, missing_facts, serial, version)


@router.get(
    UNIT + "/calibrations/{version}/certificate", summary="A certificate as it was issued", response_class=Response
)
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
    """The certificate as a file, always the same bytes; the ETag is the hash of its JSON and the format.

    `X-Labctl-State` is valid, amended, superseded or withdrawn; `X-Labctl-Withdrawn` says when, by whom and why, and
    `X-Labctl-Replaced-By` is the number of the certificate that is valid instead; absent: none is.
    """
    file = certificate_file(service.store, serial, version, format, number)
    headers = file.headers()
    if if_none_match and headers["ETag"] in if_none_match:
        return Response(status_code=304, headers=headers)
    return Response(file.content, media_type=file.media_type, headers=headers)
