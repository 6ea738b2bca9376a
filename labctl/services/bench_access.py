"""Access to the bench of a service: driven by this process, or by the bench process that it talks to."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from instruments.bench_config import BenchFile
from labctl.answers.benches import BenchDescription, StopResponse
from labctl.answers.campaigns import CampaignResponse
from labctl.answers.live import LiveHistoryResponse, LiveStateResponse
from labctl.services.benches.bench_left import BenchLeft
from labctl.services.commands.context import CampaignControl


class BenchAccess(Protocol):
    """What a service needs of its bench; all of it may be called by any thread."""

    @property
    def bench(self) -> BenchFile | None:
        """The bench, where the service has one."""
        ...

    @property
    def control(self) -> CampaignControl:
        """Return the control of the bench's campaigns."""
        ...

    @property
    def stops(self) -> bool:
        """Whether no campaign is started any more because the service ends."""
        ...

    @property
    def running(self) -> int | None:
        """The campaign that runs now."""
        ...

    @property
    def schedule_trouble(self) -> str:
        """Why the schedule could not be read; empty when all is well."""
        ...

    @property
    def heard_s(self) -> float:
        """Time since the last answer of the process that drives the bench, s; 0 for this process."""
        ...

    @property
    def not_stopped(self) -> str:
        """What is known of a stop that is late; empty where none is. Asks no database."""
        ...

    def stop(self, reason: str) -> StopResponse:
        """Stop the bench, whatever runs there. Raises NotStopped, Conflict without a bench."""
        ...

    def runs(self, campaign: int) -> bool:
        """Whether this campaign runs now; True also where the bench process does not answer and may be running it."""
        ...

    def status(self, campaign: int) -> CampaignResponse | None:
        """Return the live picture of a campaign that runs; None for any other."""
        ...

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` at every change; returns the function that ends this. A listener may not block."""
        ...

    def describe(self) -> BenchDescription | None:
        """Return the bench and what it is doing; None without a bench."""
        ...

    def live_state(self, *, watched: bool = False) -> LiveStateResponse:
        """Return the live calibration that runs, or the last; `watched`: a page follows it. Raises BenchSilent."""
        ...

    def live_history(self) -> LiveHistoryResponse:
        """Return how U fell in it, fit by fit. Raises BenchSilent."""
        ...

    def start(self) -> None:
        """Resume what an earlier process left on the bench, safe state first; then start the schedule."""
        ...

    def end_soon(self) -> None:
        """Begin nothing more and let what runs go to its end in the safe state; returns at once."""
        ...

    def close(self) -> BenchLeft:
        """End what runs, in the safe state; returns how the bench was left."""
        ...
