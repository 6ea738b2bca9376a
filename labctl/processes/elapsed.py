"""How long ago something was."""

from __future__ import annotations

from instruments.clock import Clock, SystemClock


class Elapsed:
    """Seconds since it was made or last restarted; any thread may do either."""

    def __init__(self, clock: Clock | None = None) -> None:
        self._clock = clock or SystemClock()
        self._since_s = self._clock.now_s()

    def restart(self) -> None:
        """Count from now on."""
        self._since_s = self._clock.now_s()

    @property
    def s(self) -> float:
        """The seconds."""
        return self._clock.now_s() - self._since_s
