"""The states of campaigns are written down once; what is said of a campaign follows from them."""

from __future__ import annotations

import ast

import pytest

from labctl.answers.campaigns import CampaignResponse
from labctl.services.campaigns.status import mark_abandoned
from procedures.contracts.campaign_state import ACTIVE, ENDED, NEXT, STOPPED_EARLY, UNDER_WAY, UNFINISHED, CampaignState
from tests.helpers.openapi import openapi_document
from tests.helpers.source_files import sources

#: Words that only a campaign's state has; a step is also done, failed or interrupted.
OF_CAMPAIGNS = frozenset({"aborted", "paused"})


def campaign(state: CampaignState) -> CampaignResponse:
    return CampaignResponse(id=1, recipe="short", bench="b", state=state, steps=3, progress=0.5)


def test_a_state_is_ended_or_active_or_interrupted() -> None:
    assert not ENDED & ACTIVE
    assert set(CampaignState) == ENDED | ACTIVE | {CampaignState.INTERRUPTED}
    assert frozenset(CampaignState) - ENDED == UNFINISHED
    assert UNDER_WAY < ACTIVE
    assert all(state is CampaignState.DONE or NEXT[state] for state in CampaignState)
    assert frozenset(CampaignState) - ACTIVE - {CampaignState.DONE} >= STOPPED_EARLY


@pytest.mark.parametrize("state", CampaignState)
def test_a_campaign_says_whether_it_is_over_or_in_hand(state: CampaignState) -> None:
    said = campaign(state).model_dump(mode="json")
    assert (said["state"], said["ended"], said["active"]) == (state.value, state in ENDED, state in ACTIVE)
    assert CampaignResponse.model_validate(said) == campaign(state)


def test_a_campaign_that_no_process_runs_is_not_in_hand() -> None:
    left = mark_abandoned(campaign(CampaignState.RUNNING), attended=False)
    assert left.abandoned
    assert not left.active
    assert not left.ended


def test_the_description_of_the_api_lists_the_states() -> None:
    schemas = openapi_document()["components"]["schemas"]
    assert schemas["CampaignState"]["enum"] == [state.value for state in CampaignState]
    assert schemas["CampaignResponse"]["properties"]["state"]["$ref"] == "#/components/schemas/CampaignState"
    assert {"ended", "active"} <= set(schemas["CampaignResponse"]["properties"])


@pytest.mark.slow
def test_no_other_module_lists_states_of_campaigns() -> None:
    words = {state.value for state in CampaignState}
    found = []
    for file in sources():
        if not file.is_runtime or file.name == "procedures/contracts/campaign_state.py" or "versions" in file.parts:
            continue
        for node in ast.walk(file.tree):
            if isinstance(node, ast.Set | ast.Tuple | ast.List):
                listed = {each.value for each in node.elts if isinstance(each, ast.Constant)} & words
                if len(listed) > 1 and listed & OF_CAMPAIGNS:
                    found.append(f"{file.name}:{node.lineno} {sorted(listed)}")
            elif isinstance(node, ast.Compare):
                compared = {each.value for each in node.comparators if isinstance(each, ast.Constant)}
                if compared & OF_CAMPAIGNS:
                    found.append(f"{file.name}:{node.lineno} {sorted(map(str, compared))}")
    assert not found, "take CampaignState and its sets from procedures.contracts.campaign_state"
