"""Reference standards: certificates over time, drift, intermediate checks, findings, and what each was used for."""

from __future__ import annotations

from datetime import date
from typing import Annotated

from fastapi import APIRouter, Query

from labctl.answers.standards import (
    AffectedResponse,
    StandardBadRequest,
    StandardCertificateRequest,
    StandardCheckRequest,
    StandardRequest,
    StandardResponse,
    WithdrawFindingRequest,
)
from labctl.api.access_policy import NEEDS_APPROVER
from labctl.api.dependencies import ServiceDep, command_route
from labctl.services.commands.requests import ToFinding, ToStandard
from labctl.services.commands.standards import (
    ADD_STANDARD,
    ADD_STANDARD_CERTIFICATE,
    ADD_STANDARD_CHECK,
    MARK_STANDARD_BAD,
    WITHDRAW_FINDING,
)
from labctl.services.standards import register, usage

router = APIRouter(prefix="/api/standards", tags=["standards"])
On = Annotated[date | None, Query(description="Day for state and prediction; default: today.")]


@router.get("", summary="Reference standards")
def standards(service: ServiceDep, on: On = None) -> list[StandardResponse]:
    """Every standard of the register: state, due date, certificates, drift, checks on control charts, findings."""
    return register.list_standards(service.store, on or service.clock.utc().date())


@command_route(router, ADD_STANDARD, "Enter a standard")
def add(request: StandardRequest, service: ServiceDep) -> StandardResponse:
    """Enter a standard under the name that bench files give it."""
    return service.execute(ADD_STANDARD, request)


@router.get("/{label}", summary="One standard")
def standard(label: str, service: ServiceDep, on: On = None) -> StandardResponse:
    """A standard by its label or serial number, with the value and the uncertainty that its certificates predict."""
    return register.one_standard(service.store, label, on or service.clock.utc().date())


@router.get("/{label}/affected", summary="Calibrations that a standard was used for")
def affected(
    label: str,
    service: ServiceDep,
    bad_from: Annotated[date | None, Query(description="First day; default: of its findings, else all.")] = None,
    bad_until: Annotated[date | None, Query(description="Last day.")] = None,
) -> AffectedResponse:
    """Unit, version, campaigns and certificates that are touched when the standard is bad between two days."""
    return usage.affected(service.store, label, bad_from, bad_until)


@command_route(router, ADD_STANDARD_CERTIFICATE, "Enter a certificate")
def certificate(label: str, request: StandardCertificateRequest, service: ServiceDep) -> StandardResponse:
    """Enter a certificate of a standard; one that was typed wrong is replaced by the same number with a reason."""
    return service.execute(ADD_STANDARD_CERTIFICATE, ToStandard(label, request))


@command_route(router, ADD_STANDARD_CHECK, "Enter an intermediate check")
def check(label: str, request: StandardCheckRequest, service: ServiceDep) -> StandardResponse:
    """Enter an intermediate check; out of the control limits, the state of the standard becomes `check it`."""
    return service.execute(ADD_STANDARD_CHECK, ToStandard(label, request))


@command_route(router, MARK_STANDARD_BAD, "Say that a standard was found bad")
def bad(label: str, request: StandardBadRequest, service: ServiceDep) -> StandardResponse:
    """The calibrations that it was used for on these days have a notice, and get no certificate."""
    return service.execute(MARK_STANDARD_BAD, ToStandard(label, request))


@command_route(router, WITHDRAW_FINDING, "Withdraw a finding", dependencies=[NEEDS_APPROVER])
def withdraw(label: str, finding: int, request: WithdrawFindingRequest, service: ServiceDep) -> StandardResponse:
    """Withdraw a finding that was wrong. Needs an approver's key."""
    return service.execute(WITHDRAW_FINDING, ToFinding(label, finding, request))
