"""The order of the state that is shown and the state that is recorded."""

from __future__ import annotations

from typing import Any

import pytest

from procedures.contracts.campaign_state import ENDED, CampaignState
from tests.helpers.engine_rig import Rig


def shown_while_written(rig: Rig) -> list[tuple[CampaignState, CampaignState]]:
    """Run a campaign; returns each state as it is handed to the database, with the state that is shown meanwhile."""
    found: list[tuple[CampaignState, CampaignState]] = []

    def hook(what: str, detail: Any) -> None:
        if what == "state":
            found.append((detail, rig.engine.progress.state))

    rig.journal.hooks.append(hook)
    rig.run()
    return found


def test_an_end_is_shown_only_once_it_is_recorded(rig: Rig) -> None:
    """The writer holds the row back as long as the hook runs; who sees `done` finds it in the database."""
    found = shown_while_written(rig)
    assert found[-1] == (CampaignState.DONE, CampaignState.RUNNING)
    assert rig.engine.progress.state is CampaignState.DONE


def test_an_abort_ends_shown_and_recorded(rig: Rig) -> None:
    rig.when_step("soak", lambda: rig.control.abort("enough"))
    found = shown_while_written(rig)
    assert found[-1] == (CampaignState.ABORTED, CampaignState.RUNNING)
    assert rig.engine.progress.state is CampaignState.ABORTED


def test_every_other_state_is_shown_at_once(rig: Rig) -> None:
    for state, shown in shown_while_written(rig):
        assert state in ENDED or shown is state


def test_an_end_that_cannot_be_recorded_is_still_shown(rig: Rig) -> None:
    def hook(what: str, detail: Any) -> None:
        if what == "state" and detail in ENDED:
            raise OSError("the disk is full")

    rig.journal.hooks.append(hook)
    with pytest.raises(OSError, match="disk is full"):
        rig.run()
    assert rig.engine.progress.state in ENDED
