"""Commands on diagnoses: start, confirm the experiment that is proposed, stop, resume, end for good."""

from __future__ import annotations

from labctl.answers.campaigns import ReasonRequest, ResumeRequest
from labctl.answers.diagnosis import ConfirmExperimentRequest, DiagnosisRequest, DiagnosisResponse
from labctl.errors import Conflict
from labctl.services.benches.driving_process import driven_benches, whereabouts
from labctl.services.commands.acts.abort import ABORT
from labctl.services.commands.acts.resume import RESUME
from labctl.services.commands.command import Command
from labctl.services.commands.context import CommandContext
from labctl.services.commands.requests import CampaignResume, ToCampaign, ToDiagnosis, ToUnit
from labctl.services.diagnosis import begin
from procedures.contracts.campaign_state import ENDED, CampaignState


def _start(context: CommandContext, request: ToUnit[DiagnosisRequest]) -> DiagnosisResponse:
    return begin.begin(context.store, request.serial, request.body, context.control.own_bench(), context.now())


def _refuse_elsewhere(context: CommandContext, diagnosis: int) -> None:
    """Raise Conflict where the service of another bench carries out the diagnosis: its campaign runs there."""
    store, bench = context.store, context.store.diagnoses.get(diagnosis).bench_name
    if not store.is_shared or bench not in driven_benches(store):
        return
    own = context.control.own_bench()
    if own is None or own.name != bench:
        advice = whereabouts(store, bench)
        raise Conflict(f"diagnosis {diagnosis} is not carried out here; {advice}")


def _confirm(context: CommandContext, request: ToDiagnosis[ConfirmExperimentRequest]) -> DiagnosisResponse:
    return begin.answer_experiment(context.store, request.diagnosis, request.body, context.now())


def _stop(context: CommandContext, request: ToDiagnosis[ReasonRequest]) -> DiagnosisResponse:
    """Write the stop down first: else the end of the campaign would be taken for that of the experiment."""
    _refuse_elsewhere(context, request.diagnosis)
    answer = begin.stop(context.store, request.diagnosis, request.body.text, context.now())
    _abort_campaign(context, request)
    return answer


def _resume(context: CommandContext, request: ToDiagnosis[ReasonRequest]) -> DiagnosisResponse:
    """Resume the campaign first: else its end would be taken for that of the experiment."""
    _refuse_elsewhere(context, request.diagnosis)
    if (
        campaign := begin.open_campaign(context.store, request.diagnosis)
    ) is not None and campaign.state is CampaignState.ABORTED:
        body = ResumeRequest(by=request.body.by or "a person", reason=request.body.reason)
        RESUME.execute(context, CampaignResume(campaign.id, body))
    return begin.resume(context.store, request.diagnosis, request.body.text, context.now())


def _end(context: CommandContext, request: ToDiagnosis[ReasonRequest]) -> DiagnosisResponse:
    _refuse_elsewhere(context, request.diagnosis)
    answer = begin.end(context.store, request.diagnosis, request.body.text, context.now())
    _abort_campaign(context, request)
    return answer


def _abort_campaign(context: CommandContext, request: ToDiagnosis[ReasonRequest]) -> None:
    """End the campaign that a diagnosis runs, in the safe state, or take it out of the schedule."""
    begin.withdraw_start(context.store, request.diagnosis, context.now())
    campaign = begin.open_campaign(context.store, request.diagnosis)
    if campaign is not None and campaign.state not in ENDED:
        ABORT.execute(context, ToCampaign(campaign.id, request.body))


_DIAGNOSIS = "/api/diagnoses/{diagnosis}"

START_DIAGNOSIS = Command(
    method="POST", path="/api/units/{serial}/diagnoses", handler=_start, responses={201: DiagnosisResponse}
)
CONFIRM_EXPERIMENT = Command(
    method="POST", path=_DIAGNOSIS + "/confirm", handler=_confirm, responses={200: DiagnosisResponse}
)
STOP_DIAGNOSIS = Command(method="POST", path=_DIAGNOSIS + "/stop", handler=_stop, responses={200: DiagnosisResponse})
RESUME_DIAGNOSIS = Command(
    method="POST", path=_DIAGNOSIS + "/resume", handler=_resume, responses={200: DiagnosisResponse}
)
END_DIAGNOSIS = Command(method="POST", path=_DIAGNOSIS + "/end", handler=_end, responses={200: DiagnosisResponse})
