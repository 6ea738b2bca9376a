"""Drafts as they are in the database; light to load, as a status is asked for often."""

from __future__ import annotations

from collections.abc import Sequence

from labctl.answers.campaigns import CampaignResponse
from labctl.answers.drafts import DraftReport, DraftResponse
from labctl.store import DraftRow, Store
from procedures.contracts.campaign_state import CampaignState


def drafts_of(store: Store, campaign: int) -> list[DraftResponse]:
    """Return the drafts of a campaign as they are."""
    rows = store.drafts.of_campaign(campaign)
    return _answers(store, rows)


def newest_drafts(store: Store, serials: Sequence[str]) -> dict[str, DraftResponse]:
    """Return serial number -> the draft that was made, or failed, last; a unit none of whose campaigns ended in one is
    left out."""
    return {answer.serial: answer for answer in _answers(store, store.drafts.newest_of_units(serials))}


def with_drafts(store: Store, answer: CampaignResponse) -> CampaignResponse:
    """Return the status of a campaign with its drafts, once it is done."""
    if answer.state is not CampaignState.DONE:
        return answer
    drafts = drafts_of(store, answer.id)
    return answer.model_copy(update={"drafts": drafts}) if drafts else answer


def _answers(store: Store, rows: list[DraftRow]) -> list[DraftResponse]:
    if not rows:
        return []
    serials = list({row.serial for row in rows})
    in_force = {serial: act.version for serial, act in store.certifications.in_force(serials).items()}
    return [
        DraftResponse(
            serial=row.serial, campaign=row.campaign, recording=row.recording, state=row.state, version=row.version,
            certified=row.version is not None and in_force.get(row.serial) == row.version, at=row.at,
            reason=row.reason, report=None if row.report is None else DraftReport.model_validate(row.report),
        )
        for row in rows
    ]  # fmt: skip
