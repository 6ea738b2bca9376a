"""Counters of streams: how far each reading is from the one before, repeated readings, and a counter that stands."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from instruments.errors import MalformedReply

Whole = NDArray[np.int64]
#: A counter that has not moved in this many readings is broken.
MAX_STANDING = 50


class SampleCounter:
    """Counter of one stream: it moves by `step` with each reading and begins again at 0 after `wrap` - 1."""

    def __init__(self, device: str, port: str | None, *, step: int, wrap: int) -> None:
        self._device, self._port, self._step, self._wrap = device, port, step, wrap
        #: How many lost readings leave the counter as it was.
        self.readings_per_turn = wrap // step if wrap % step == 0 else wrap
        self._newest: int | None = None
        self._content: NDArray[np.generic] | None = None
        self._standing = 0
        self._moved: Whole | None = None

    @property
    def step(self) -> int | None:
        """Get by how much the counter usually moves; None before two readings came together."""
        return None if self._moved is None else int(np.median(self._moved))

    def drop(self) -> None:
        """Expect any count next."""
        self._newest, self._content = None, None

    def is_new(self, counts: Whole, content: NDArray[np.generic]) -> NDArray[np.bool_]:
        """Return which readings (n >= 1,) are not the one before sent again: same count, same `content` (n, k)."""
        moved = self._from_before(counts, counts[0] - 1)
        last, self._content = self._content, content[-1].copy()
        if moved.all():
            return moved != 0
        standing = moved == 0
        before = np.vstack([content[:1] if last is None else last[None], content[:-1]])
        new: NDArray[np.bool_] = ~standing | (content != before).any(axis=1)
        if not new.all():
            self._stands(counts, ~new)
        return new

    def advance(self, counts: Whole) -> Whole:
        """Return how many readings each of n >= 1 is from the one before, at least 1; raises MalformedReply.

        A counter that comes to the same number has turned once; one that stands in MAX_STANDING readings is broken.
        """
        moved = self._from_before(counts, counts[0] - self._step) % self._wrap
        self._newest = int(counts[-1])
        if len(moved) > 1:
            self._moved = moved[1:]
        if moved.all():
            self._standing = 0
        else:
            self._stands(counts, moved == 0)
        advance = moved // self._step
        advance[advance == 0] = self.readings_per_turn
        return advance

    def _from_before(self, counts: Whole, first: np.int64) -> Whole:
        """Return by how much each count differs from the one before; `first` stands before the first of all."""
        moved = np.empty_like(counts)
        moved[0] = counts[0] - (first if self._newest is None else self._newest)
        np.subtract(counts[1:], counts[:-1], out=moved[1:])
        return moved

    def _stands(self, counts: Whole, standing: NDArray[np.bool_]) -> None:
        """Raise MalformedReply where the counter has not moved for too long."""
        moved = np.flatnonzero(~standing)
        self._standing = self._standing + len(standing) if not len(moved) else len(standing) - 1 - int(moved[-1])
        if self._standing >= MAX_STANDING:
            raise MalformedReply(
                self._device,
                f"the sample counter on {self._port} does not advance: it is {int(counts[-1])} in {self._standing} "
                "successive readings; check that the bench file names the right field of the frame as the counter; "
                "if it does, switch the unit off and on",
            )
