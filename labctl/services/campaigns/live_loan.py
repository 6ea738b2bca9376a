"""A bench that a live calibration has: a unit on it is read while a person turns it, and nothing else may begin."""

from __future__ import annotations

from collections.abc import Callable

from labctl.errors import BenchBusy


class LiveLoan:
    """Whether a bench is lent to a live calibration, and how that ends it. Changed under the guard of the bench."""

    def __init__(self, bench: str) -> None:
        self._bench = bench
        self.serial = ""  #: of the unit that is read; empty: the bench is not lent
        self._end: Callable[[str], None] = _nothing

    def lend(self, serial: str, end: Callable[[str], None], begin: Callable[[], None]) -> None:
        """Lend the bench to the calibration that `begin` begins; it is not lent where that raises.

        `end` ends the calibration for a reason, and returns once its ports are closed.
        """
        self.serial, self._end = serial, end
        try:
            begin()
        except BaseException:
            self.take_back()
            raise

    def refuse(self) -> None:
        """Raise BenchBusy while it is lent."""
        if self.serial:
            raise BenchBusy(
                f"bench {self._bench}: unit {self.serial} is being calibrated live; wait for its end, or end it on the "
                "page Live"
            )

    def end(self, why: str) -> None:
        """End the calibration that has it; nothing where none has."""
        if self.serial:
            self._end(why)

    def take_back(self) -> None:
        """Take it back; safe to call twice, by any thread."""
        self.serial, self._end = "", _nothing


def _nothing(_: str) -> None:
    return
