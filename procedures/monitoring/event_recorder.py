"""Writes to the journal: every entry gets campaign time and aware UTC, and the progress follows."""

from __future__ import annotations

from instruments.clock import Clock
from procedures.contracts.campaign_state import ENDED, CampaignState
from procedures.contracts.journal import Event, Journal
from procedures.contracts.steps import StepResult
from procedures.monitoring.campaign_time import CampaignTime
from procedures.monitoring.progress import ProgressTracker


class CampaignRecorder:
    """Writes to the journal and updates the progress with every entry."""

    def __init__(self, journal: Journal, clock: Clock, tracker: ProgressTracker, time: CampaignTime) -> None:
        self.journal = journal
        self.clock = clock
        self.tracker = tracker
        self.time = time
        self.state = CampaignState.PLANNED

    def t_s(self) -> float:
        """Return the present campaign time in s."""
        return self.time.now_s()

    def change_state(self, state: CampaignState, reason: str) -> None:
        """Record a change of the campaign's state.

        An end is shown once it is recorded, or could not be: who sees the end finds it in the database. Every other
        state is shown at once.
        """
        self.state = state
        if state not in ENDED:
            self.tracker.update(state=state, reason=reason)
        try:
            self.journal.campaign_state(state, reason, self.t_s(), self.clock.utc())
        finally:
            if state in ENDED:
                self.tracker.update(state=state, reason=reason)

    def event(self, event: Event) -> None:
        """Record something worth telling a person."""
        if event.level == "error":
            self.tracker.update(last_error=event.message)
        self.journal.event(event, self.t_s(), self.clock.utc())

    def step_started(self, index: int) -> None:
        """Record that a step of the plan begins."""
        self.tracker.step_started(index, self.t_s())
        self.journal.step_started(index, self.t_s(), self.clock.utc())

    def step_ended(self, index: int, result: StepResult) -> None:
        """Record how a step of the plan ended, with the time it took among its figures."""
        took_s = self.t_s() - self.tracker.step_began_s
        result = result.model_copy(update={"figures": {**result.figures, "took_s": took_s}})
        self.tracker.step_ended(index)
        self.journal.step_ended(index, result, self.t_s(), self.clock.utc())


def warning(kind: str, message: str, device: str | None = None) -> Event:
    """Return an event that a person should read."""
    return Event(kind, message, level="warning", device=device)
