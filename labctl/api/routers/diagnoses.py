"""Diagnoses: start, state, confirmation of an experiment, stop, resume, end."""

from __future__ import annotations

from fastapi import APIRouter

from labctl.answers.campaigns import ReasonRequest
from labctl.answers.diagnosis import ConfirmExperimentRequest, DiagnosisRequest, DiagnosisResponse
from labctl.api.dependencies import ServiceDep, command_route
from labctl.services.commands.diagnoses import (
    CONFIRM_EXPERIMENT,
    END_DIAGNOSIS,
    RESUME_DIAGNOSIS,
    START_DIAGNOSIS,
    STOP_DIAGNOSIS,
)
from labctl.services.commands.requests import ToDiagnosis, ToUnit
from labctl.services.diagnosis.answer import diagnoses_of_unit, diagnosis_answer

router = APIRouter(prefix="/api", tags=["diagnoses"])


@command_route(router, START_DIAGNOSIS, "Diagnose a unit")
def start(serial: str, request: DiagnosisRequest, service: ServiceDep) -> DiagnosisResponse:
    """Run experiments on this service's bench, one after the other, until one missing effect is left.

    Answered at once; the service carries it out. On a bench that is not simulated a person confirms each experiment.
    Refused while another diagnosis of the unit has not ended.
    """
    return service.execute(START_DIAGNOSIS, ToUnit(serial, request))


@router.get("/units/{serial}/diagnoses", summary="Diagnoses of a unit")
def diagnoses(serial: str, service: ServiceDep) -> list[DiagnosisResponse]:
    """Every diagnosis of the unit with its rounds, the newest first."""
    return diagnoses_of_unit(service.store, serial)


@router.get("/diagnoses/{diagnosis}", summary="One diagnosis")
def diagnosis(diagnosis: int, service: ServiceDep) -> DiagnosisResponse:
    """How far it is: each round with the probability of every suspect, the experiment chosen by it, and its result."""
    return diagnosis_answer(service.store, diagnosis)


@command_route(router, CONFIRM_EXPERIMENT, "Confirm an experiment")
def confirm(diagnosis: int, request: ConfirmExperimentRequest, service: ServiceDep) -> DiagnosisResponse:
    """Have the proposed experiment run, or answer that it cannot be done; then the next best one is proposed."""
    return service.execute(CONFIRM_EXPERIMENT, ToDiagnosis(diagnosis, request))


@command_route(router, STOP_DIAGNOSIS, "Stop a diagnosis")
def stop(diagnosis: int, request: ReasonRequest, service: ServiceDep) -> DiagnosisResponse:
    """Stop it, and end the campaign that it runs, in the safe state; it can be resumed."""
    return service.execute(STOP_DIAGNOSIS, ToDiagnosis(diagnosis, request))


@command_route(router, RESUME_DIAGNOSIS, "Resume a diagnosis")
def resume(diagnosis: int, request: ReasonRequest, service: ServiceDep) -> DiagnosisResponse:
    """Continue one that was stopped, or could not go on; its campaign is resumed, safe state first."""
    return service.execute(RESUME_DIAGNOSIS, ToDiagnosis(diagnosis, request))


@command_route(router, END_DIAGNOSIS, "End a diagnosis")
def end(diagnosis: int, request: ReasonRequest, service: ServiceDep) -> DiagnosisResponse:
    """End it for good, and the campaign that it runs, in the safe state."""
    return service.execute(END_DIAGNOSIS, ToDiagnosis(diagnosis, request))
