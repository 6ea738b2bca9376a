"""Making the drafts of a campaign that is done: fitted and kept once, then reported on, both after any interruption."""

from __future__ import annotations

from datetime import datetime

from labctl.answers.calibrations import FitRequest
from labctl.answers.drafts import DraftsRequest, DraftsResponse
from labctl.errors import Conflict, DataRefused, LabctlError
from labctl.log import get_logger
from labctl.progress import report_stage
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.drafts.answers import drafts_of
from labctl.services.drafts.as_found import REFUSALS
from labctl.services.drafts.report import report_on
from labctl.services.drafts.text import failure_text
from labctl.store import DraftEvent, DraftRow, Store
from procedures.contracts.campaign_state import CampaignState
from procedures.recipe.fit_rules import FitRules

log = get_logger()


def make_drafts(store: Store, campaign: int, request: DraftsRequest, at: datetime) -> DraftsResponse:
    """Make what is due of a campaign's drafts; with `again` also what failed before. Nothing is made twice.

    Data that cannot be fitted become the reason of a failed draft. Raises NotFound, Conflict for a campaign that is
    not done.
    """
    row = store.campaigns.get(campaign)
    if row.state is not CampaignState.DONE:
        raise Conflict(
            f"campaign {campaign} is in the state {row.state}, but its drafts (proposed calibrations) are made "
            "when it is done; wait for its end, or resume the campaign"
        )
    fit_rules = row.recipe.get("fit")
    if fit_rules is not None:
        rules = FitRules.model_validate(fit_rules)
        for draft in store.drafts.of_campaign(campaign):
            if draft.state in {"due", "fitted"} or (request.again and draft.state == "failed"):
                _make(store, draft, rules, at)
    return DraftsResponse(campaign=campaign, drafts=drafts_of(store, campaign))


def _make(store: Store, draft: DraftRow, rules: FitRules, at: datetime) -> None:
    if reason := store.drafts.dropped(draft.recording):
        fail_draft(store, draft, rules, f"the unit was excluded from the campaign: {reason}", at)
        return
    version = draft.version  # of a draft that was kept, and not yet reported on
    if version is None:
        report_stage(f"fitting {draft.serial}")
        request = FitRequest(
            recording=draft.recording, model=rules.model, effects=list(rules.effects), type_prior=rules.type_prior
        )
        try:
            version = fit_unit(store, draft.serial, request, at, is_draft=True).version
        except REFUSALS as error:
            fail_draft(store, draft, rules, _without_insisting(error), at)
            return
        except Conflict:  # another process made it meanwhile, and reports on it
            return
    report = report_on(store, store.calibrations.get(draft.serial, version), draft.recording, rules)
    is_well = report.within_limits is not False and not report.objections
    document = report.model_dump(mode="json")
    event = DraftEvent(report.text, "info" if is_well else "warning")
    if store.drafts.conclude(draft.recording, document, event, at):
        log.info(
            "draft.made", campaign=draft.campaign, serial=draft.serial, recording=draft.recording, version=version,
            model=report.model, verdict=report.verdict, within_limits=report.within_limits,
            rms_dps=report.error.rms_dps, heldout_rms_dps=report.error.heldout_rms_dps,
        )  # fmt: skip


def fail_draft(store: Store, draft: DraftRow, rules: FitRules, why: str, at: datetime) -> None:
    """Write down why a draft could not be made and what to do; the campaign stays done."""
    option = f"--model {rules.model}" if rules.model is not None else f"--effects {','.join(rules.effects)}"
    reason = failure_text(draft.serial, draft.recording, option, why)
    if store.drafts.fail(draft.recording, reason, DraftEvent(reason, "warning"), at):
        log.warning("draft.failed", campaign=draft.campaign, serial=draft.serial, reason=reason)


def _without_insisting(error: LabctlError) -> str:
    """Return an error in words, without the hint to an option that a draft does not have."""
    return (
        str(error).replace("; to do it nevertheless: --accept-warnings", "")
        if isinstance(error, DataRefused)
        else str(error)
    )
