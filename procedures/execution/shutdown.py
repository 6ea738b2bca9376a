"""The end of a campaign: the bench in its safe state, whatever happened before, and the final state in the journal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.journal import NOT_SAFE, Event
from procedures.execution.context import ExecutionContext
from procedures.execution.safe_state import TABLE, make_safe
from procedures.execution.signals import ignore_signals


@dataclass(frozen=True)
class Outcome:
    """How a campaign ended, and why."""

    state: CampaignState
    reason: str
    safe: bool  #: whether every part of the safe state was confirmed


class Shutdown:
    """Ends a campaign in the safe state. `complaints` holds what the last safe state could not confirm."""

    def __init__(self, context: ExecutionContext) -> None:
        self._context = context
        self.complaints: tuple[str, ...] = ()  #: set before the journal is written, so known when writing fails
        self._open: dict[str, str] = {}  #: what is not confirmed yet, and why, in the order in which it was tried

    def end(
        self, state: CampaignState, reason: str, on_ending: Callable[[], None] = lambda: None, *, bench_is_safe: bool
    ) -> Outcome:
        """Make the bench safe, unless its last step did, and record how the campaign ended.

        Signals are ignored meanwhile; an interrupt from before that begins the shutdown again, `on_ending` first.
        """
        self._context.control.leave_step()
        while True:
            try:
                on_ending()
                with ignore_signals():
                    return self._end(state, reason, bench_is_safe=bench_is_safe)
            except KeyboardInterrupt:
                continue

    def _end(self, state: CampaignState, reason: str, *, bench_is_safe: bool) -> Outcome:
        recorder = self._context.recorder
        if not bench_is_safe:
            recorder.tracker.update(step_text="setting the bench to its safe state")
        self.complaints = ()
        self._open = {}
        if not bench_is_safe:
            self.complaints = make_safe(self._context.full_bench, self._context.clock, note=self._note)
        self._context.control.note_safe_state("; ".join(self.complaints), at_rest=bench_is_safe)
        self._context.monitor.tell_stalls(at_the_end=True)
        if self.complaints:
            text = NOT_SAFE + "; ".join(self.complaints)
            reason = f"{reason}. {text}"
            state = CampaignState.FAILED if state is CampaignState.DONE else state
            recorder.event(Event("safe_state", text, level="error"))
        recorder.change_state(state, reason)
        return Outcome(state, reason, safe=not self.complaints)

    def _note(self, text: str, complaint: str) -> None:
        """Show how far the safe state is, with all that is open: a silent instrument is no campaign that runs."""
        if complaint:
            self._open[text] = complaint
        else:
            self._open.pop(text, None)
        hindrance = "; ".join(f"{part}: {why}" for part, why in self._open.items())
        self._context.control.note_safe_state(hindrance, at_rest=text == TABLE and not complaint)
        if hindrance:
            self._context.recorder.tracker.update(step_text=f"stopping: {hindrance}", last_error=hindrance)
