"""Commands on the register of reference standards, on check gyros, and on the environment of the room."""

from __future__ import annotations

from labctl.answers.standards import (
    StandardBadRequest,
    StandardCertificateRequest,
    StandardCheckRequest,
    StandardRequest,
    StandardResponse,
    WithdrawFindingRequest,
)
from labctl.answers.validity import CheckGyroRequest, CheckGyroResponse, RoomEnvironmentRequest, RoomEnvironmentResponse
from labctl.services import check_gyros, room_environment
from labctl.services.commands.command import Command
from labctl.services.commands.context import CommandContext
from labctl.services.commands.requests import ToFinding, ToStandard, ToUnit
from labctl.services.standards import register


def _add(context: CommandContext, request: StandardRequest) -> StandardResponse:
    return register.add_standard(context.store, request, context.now())


def _certificate(context: CommandContext, request: ToStandard[StandardCertificateRequest]) -> StandardResponse:
    return register.add_certificate(context.store, request.label, request.body, context.now())


def _check(context: CommandContext, request: ToStandard[StandardCheckRequest]) -> StandardResponse:
    return register.add_check(context.store, request.label, request.body, context.now())


def _bad(context: CommandContext, request: ToStandard[StandardBadRequest]) -> StandardResponse:
    return register.mark_bad(context.store, request.label, request.body, context.now())


def _withdraw(context: CommandContext, request: ToFinding[WithdrawFindingRequest]) -> StandardResponse:
    return register.withdraw_finding(context.store, request.label, request.finding, request.body, context.now())


def _check_gyro(context: CommandContext, request: ToUnit[CheckGyroRequest]) -> CheckGyroResponse:
    return check_gyros.set_check_gyro(context.store, request.serial, request.body, context.now())


def _environment(context: CommandContext, request: RoomEnvironmentRequest) -> RoomEnvironmentResponse:
    return room_environment.add_readings(context.store, request, context.now())


_STANDARD = "/api/standards/{label}"

ADD_STANDARD = Command(method="POST", path="/api/standards", handler=_add, responses={201: StandardResponse})
ADD_STANDARD_CERTIFICATE = Command(
    method="POST", path=_STANDARD + "/certificates", handler=_certificate, responses={201: StandardResponse}
)
ADD_STANDARD_CHECK = Command(
    method="POST", path=_STANDARD + "/checks", handler=_check, responses={201: StandardResponse}
)
MARK_STANDARD_BAD = Command(
    method="POST", path=_STANDARD + "/findings", handler=_bad, responses={201: StandardResponse}
)
WITHDRAW_FINDING = Command(
    method="POST",
    path=_STANDARD + "/findings/{finding}/withdraw",
    handler=_withdraw,
    responses={200: StandardResponse},
)
SET_CHECK_GYRO = Command(
    method="POST", path="/api/check-gyros/{serial}", handler=_check_gyro, responses={200: CheckGyroResponse}
)
ADD_ENVIRONMENT = Command(
    method="POST", path="/api/environment", handler=_environment, responses={201: RoomEnvironmentResponse}
)
