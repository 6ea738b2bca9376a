"""The progress of a stop that was requested: of a campaign that runs, or of a bench without one."""

from __future__ import annotations

import threading
from collections.abc import Callable

from labctl.services.campaigns.campaign_job import CampaignJob
from procedures.contracts.control import Control

#: Interval at which the end of a campaign is checked until its table is confirmed to be at rest, s.
POLL_S = 0.2


class CampaignStop:
    """The end of a campaign that runs, in the safe state."""

    def __init__(self, campaign: int, control: Control, has_ended: Callable[[], bool]) -> None:
        """Follow the end of a campaign; `has_ended`: whether its engine has ended, the table at rest or not."""
        self._control, self._has_ended = control, has_ended
        self.campaign: int | None = campaign

    @classmethod
    def of(cls, job: CampaignJob) -> CampaignStop:
        """Follow the end of a campaign that runs in a thread."""

        def has_ended() -> bool:
            thread = job.thread
            return thread is not None and thread.ident is not None and not thread.is_alive()

        return cls(job.row.id, job.control, has_ended)

    def is_heard(self, within_s: float) -> bool:
        """Wait until the engine has left its step; returns whether it has."""
        return self._control.is_heard(within_s)

    def is_over(self, within_s: float) -> bool:
        """Wait until the table stands, or the engine has ended without that; returns whether either came."""
        waited_s = 0.0
        while not self._control.is_at_rest(min(POLL_S, within_s)):
            waited_s += POLL_S
            ended = self._has_ended()
            if ended or waited_s >= within_s:
                return ended
        return True

    @property
    def stands(self) -> bool:
        """Whether the table is confirmed to stand."""
        return self._control.is_at_rest(0.0)

    @property
    def text(self) -> str:
        """State of the stop, or what delays it."""
        if self._control.hindrance:
            return f"campaign {self.campaign}: {self._control.hindrance}"
        return f"campaign {self.campaign}: {'the table is at rest' if self.stands else 'the table is being stopped'}"


class IdleStop:
    """A stop while no campaign runs: the instruments are made safe as soon as the bench is released."""

    campaign: int | None = None

    def __init__(self, make_safe: Callable[[], CampaignStop | str]) -> None:
        """Call `make_safe` in a thread; it returns what is not confirmed, or the campaign that has begun meanwhile."""
        self._make_safe = make_safe
        self._over = threading.Event()
        self._begun: CampaignStop | None = None
        self._trouble = "the bench is being made safe"
        threading.Thread(target=self._work, name="stop-idle", daemon=True).start()

    def _work(self) -> None:
        try:
            problem = self._make_safe()
        except Exception as error:  # noqa: BLE001  it is the answer, whatever it is
            problem = str(error) or type(error).__name__
        if isinstance(problem, CampaignStop):
            self._begun = problem
        else:
            self._trouble = problem
        self._over.set()

    def is_heard(self, within_s: float) -> bool:  # noqa: ARG002  no engine runs that would have to hear it
        """Return True: nothing runs that would have to leave a step."""
        return True

    def is_over(self, within_s: float) -> bool:
        """Wait until the instruments have answered; returns whether they have."""
        if not self._over.wait(within_s):
            return False
        return self._begun is None or self._begun.is_over(within_s)

    @property
    def stands(self) -> bool:
        """Whether the bench is confirmed to be safe."""
        if self._begun is not None:
            return self._begun.stands
        return self._over.is_set() and not self._trouble

    @property
    def text(self) -> str:
        """What is known of the bench."""
        if self._begun is not None:
            return self._begun.text
        return self._trouble or "no campaign runs, and the table is at rest"


class StopElsewhere:
    """A stop of a campaign that does not run here, or of a service that drives no bench."""

    campaign: int | None = None

    def __init__(self, text: str, *, stands: bool) -> None:
        """Set the reason; `stands`: whether nothing moves that this service could stop."""
        self.text, self.stands = text, stands

    def is_heard(self, within_s: float) -> bool:  # noqa: ARG002  there is nothing to wait for
        """Return True."""
        return True

    def is_over(self, within_s: float) -> bool:  # noqa: ARG002  as above
        """Return True."""
        return True
