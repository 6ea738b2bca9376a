"""How each device of a bench can be reached: when it last answered, and whether its link is degraded or lost."""

from __future__ import annotations

from typing import Literal

from procedures.contracts.journal import Event
from procedures.monitoring.event_recorder import CampaignRecorder
from procedures.monitoring.host_stalls import HostStalls

LinkState = Literal["well", "degraded", "lost"]  #: degraded: silent for a moment; lost: silent for too long


class LinkStates:
    """The links of one bench. A change of state is an event; only what is not well is shown in the progress."""

    def __init__(self, recorder: CampaignRecorder, stalls: HostStalls) -> None:
        self._recorder, self._stalls = recorder, stalls
        #: device -> campaign time, and the stalls of this computer until then, s of the bench's clock
        self._heard_s: dict[str, tuple[float, float]] = {}
        self._broken: dict[str, LinkState] = {}

    def restart(self) -> None:
        """Forget when any device has answered."""
        self._heard_s = {}

    def heard(self, device: str) -> None:
        """Note that a device answered just now."""
        self._heard_s[device] = self._recorder.t_s(), self._stalls.total_clock_s()

    def forget(self, device: str, *, repaired: bool = False) -> None:
        """Note that a device no longer answers; with `repaired` a broken link is well again without an event."""
        self._heard_s.pop(device, None)
        if repaired:
            self._broken.pop(device, None)

    def is_broken(self, device: str) -> bool:
        """Return whether a device is degraded or lost."""
        return device in self._broken

    def silent_s(self, t_s: float) -> dict[str, float]:
        """Return how long each device has been silent at campaign time `t_s`, in s, without this computer's stalls."""
        stalled_s = self._stalls.total_clock_s()
        return {
            device: max(t_s - heard_s - (stalled_s - before_s), 0.0)
            for device, (heard_s, before_s) in self._heard_s.items()
        }

    def change(self, device: str, state: LinkState, why: str = "") -> None:
        """Take in how a device can be reached. What is lost is not merely degraded again."""
        before = self._broken.get(device, "well")
        if state == before or (before == "lost" and state == "degraded"):
            return
        if state == "well":
            del self._broken[device]
            self._recorder.event(Event("link.well", f"{device}: answers again", device=device))
        else:
            self._broken[device] = state
            level = "warning" if state == "degraded" else "error"
            self._recorder.event(Event(f"link.{state}", why, level=level, device=device))
        self._recorder.tracker.update(links=dict(self._broken))
