"""The states of a campaign: one enum, which state may follow which, and what a state says of the bench."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum


class CampaignState(StrEnum):
    """Where a campaign is in its life."""

    PLANNED = "planned"
    RUNNING = "running"
    PAUSED = "paused"
    WAITING = "waiting"  #: for a person: a mounting to confirm
    INTERRUPTED = "interrupted"  #: the bench had to be released; to be resumed
    DONE = "done"
    ABORTED = "aborted"
    FAILED = "failed"


_S = CampaignState
#: Ways to stop before the end of the plan.
_ENDS = frozenset({_S.INTERRUPTED, _S.ABORTED, _S.FAILED})
#: Which state may follow which. Only `done` is final: a failed or aborted campaign is resumed when a person asks for
#: it, one that was interrupted, or left by a process that died, by the service itself. A suspension during a pause is
#: again a pause, with another reason.
NEXT: Mapping[CampaignState, frozenset[CampaignState]] = {
    _S.PLANNED: frozenset({_S.RUNNING, *_ENDS}),
    _S.RUNNING: frozenset({_S.RUNNING, _S.PAUSED, _S.WAITING, _S.DONE, *_ENDS}),
    _S.PAUSED: frozenset({_S.RUNNING, _S.PAUSED, *_ENDS}),
    _S.WAITING: frozenset({_S.RUNNING, *_ENDS}),
    _S.INTERRUPTED: frozenset({_S.RUNNING, _S.FAILED}),
    _S.DONE: frozenset(),
    _S.ABORTED: frozenset({_S.RUNNING}),
    _S.FAILED: frozenset({_S.RUNNING}),
}

#: Over: nothing happens any more unless a person resumes the campaign.
ENDED: frozenset[CampaignState] = frozenset({_S.DONE, _S.ABORTED, _S.FAILED})
#: A process runs the campaign, unless that process has ended.
ACTIVE: frozenset[CampaignState] = frozenset({_S.PLANNED, _S.RUNNING, _S.PAUSED, _S.WAITING})
#: The bench may move or be hot; an interrupted campaign had its safe state, a planned one has not begun.
UNDER_WAY: frozenset[CampaignState] = ACTIVE - {_S.PLANNED}
#: Not ended: active campaigns, and those to be resumed.
UNFINISHED: frozenset[CampaignState] = ACTIVE | {_S.INTERRUPTED}
#: Stopped before the end of the plan.
STOPPED_EARLY: frozenset[CampaignState] = _ENDS
