"""Lines of a turned unit that arrive when a test allows it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from queue import SimpleQueue
from typing import Any

from tests.helpers.turned_unit import TurnedUnit

Columns = Mapping[str, Any]


class PacedFeed:
    """Blocks of `block_s` as CSV lines: as many as were allowed, then all that are asked for once it runs free."""

    may_lose = False

    name = "paced feed"

    def __init__(self, seed: int = 1, block_s: float = 0.5, change: Callable[[Columns], Columns] = lambda c: c) -> None:
        self.unit = TurnedUnit(seed)
        self._block_s, self._change = block_s, change
        self._tokens: SimpleQueue[bool] = SimpleQueue()  # True: a block, False: the end
        self._free = self._begun = self.closed = False
        self.turn: Callable[[TurnedUnit], object] = _leave  #: what the person does before each block

    def allow(self, blocks: int) -> None:
        """Let so many blocks arrive."""
        for _ in range(blocks):
            self._tokens.put(True)

    def run_free(self) -> None:
        """Let all further blocks arrive."""
        self._free = True
        self._tokens.put(True)

    def break_off(self) -> None:
        """End the stream after the blocks that were allowed."""
        self._tokens.put(False)

    def open(self) -> None:
        pass

    def take(self) -> bytes | None:
        if not self._free and not self._tokens.get():
            return None
        self.turn(self.unit)
        columns = self._change(self.unit.block(self._block_s))
        header = b"" if self._begun else (",".join(columns) + "\n").encode()
        self._begun = True
        rows = zip(*(values.tolist() for values in columns.values()), strict=True)
        return header + "".join(",".join(map(repr, row)) + "\n" for row in rows).encode()

    def close(self) -> None:
        self.closed = True


def _leave(_: TurnedUnit) -> None:
    return
