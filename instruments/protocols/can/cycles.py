"""Readings of the messages of one cycle, whatever the order in which these come."""

from __future__ import annotations

import numpy as np

from instruments.protocols.can.frames import BUS_OFF, ERROR, ERROR_CLASSES, FRAME_BYTES, CanFrame, FrameScanner
from instruments.protocols.can.signals import COUNTER, CanLayout
from instruments.protocols.stream_formats.document import BINARY_STEP
from instruments.protocols.stream_formats.readings import MAX_STEPS, Decoded

Numbers = dict[str, int]


class CycleDecoder:
    """Makes readings of the frames of a bus; messages of other nodes are passed over.

    The messages of a cycle belong together by their counter, where each has it, else from one message that begins a
    cycle to the next. A cycle from which a message is missing is damaged, and so is a message that comes twice, and an
    error frame of the bus.
    """

    def __init__(self, layout: CanLayout) -> None:
        self._layout, self._scanner = layout, FrameScanner()
        self._names = [name for part in layout.parts.values() for name, _ in part]
        self._needed = frozenset(self._names) - layout.held
        self._held: Numbers = {}
        self._cycle: Numbers = {}
        self._is_fit = True  #: whether every number of the cycle is one
        self._is_headless = False  #: whether messages came of a cycle whose first one did not
        self._damaged = self._missed = 0
        self._ranges = [
            (name, each.code_range)
            for part in layout.parts.values()
            for name, each in part
            if name.startswith("gyro_") and not each.is_float
        ]
        self.seen: set[int] = set()  #: messages that came since `drop`
        self.errors: dict[str, int] = {}  #: class of error frames -> how many came since `drop`

    @property
    def is_bus_off(self) -> bool:
        """Whether the interface has left the bus."""
        return ERROR_CLASSES[BUS_OFF] in self.errors

    @property
    def missing(self) -> list[str]:
        """Names of the messages of a reading that did not come since `drop`."""
        return [self._layout.database.message_name(key) for key in self._layout.parts if key not in self.seen]

    def drop(self) -> None:
        """Drop the unfinished frame and the unfinished cycle."""
        self._scanner.drop()
        self._cycle, self._is_fit, self._is_headless = {}, True, False
        self._damaged = self._missed = 0
        self.seen, self.errors = set(), {}

    def feed(self, data: bytes) -> Decoded:
        """Return the readings of every cycle that is whole now."""
        frames, damaged = self._scanner.feed(data)
        rows: list[Numbers] = []
        valid: list[bool] = []
        behind: list[int] = []
        for number, frame in enumerate(frames, start=1):
            if frame.id & ERROR:
                self._note_error(frame)
            elif frame.id in self._layout.parts and (row := self._add(frame)) is not None:
                rows.append(row)
                behind.append(FRAME_BYTES * (len(frames) - number) + self._scanner.waiting)
                valid.append(self._is_fit and self._is_good(row))
                self._is_fit = True
        missed, damaged = self._missed, damaged + self._damaged + self._missed
        self._damaged = self._missed = 0
        values = {name: np.array([row[name] for row in rows], dtype=np.int64) for name in dict.fromkeys(self._names)}
        return Decoded(values, np.array(valid, dtype=bool), np.array(behind, dtype=np.int64), damaged, missed)

    def _note_error(self, frame: CanFrame) -> None:
        self._damaged += 1
        for bit, text in ERROR_CLASSES.items():
            if frame.id & bit:
                self.errors[text] = self.errors.get(text, 0) + 1

    def _add(self, frame: CanFrame) -> Numbers | None:
        """Take in a message of the unit; return the reading that it completes."""
        raw = self._layout.database.raw(frame.id, frame.data)
        if raw is None:
            self._damaged += not self._layout.database.is_multiplexed(frame.id)
            return None
        self.seen.add(frame.id)
        raw_values = {name: raw[each.name] for name, each in self._layout.parts[frame.id] if each.name in raw}
        numbers = {name: self._whole(value) for name, value in raw_values.items()}
        self._held |= {name: numbers.pop(name) for name in self._layout.held & set(numbers)}
        if not numbers or not self._continues(frame.id, raw, numbers):
            return None
        self._cycle |= numbers
        if len(self._cycle) < len(self._needed):
            return None
        row, self._cycle = self._cycle | self._held, {}
        return row if self._layout.held <= set(row) else None

    def _continues(self, frame_id: int, raw: dict[str, int | float], numbers: Numbers) -> bool:
        """Return whether a message belongs to the cycle, which begins anew where it has to."""
        layout = self._layout
        if layout.is_counted_apart:
            if self._cycle and self._cycle[COUNTER] != numbers[COUNTER]:
                self._begin()
        elif layout.first is not None:
            begins = frame_id == layout.first and layout.first_name in raw
            if begins:
                self._begin()
            elif not self._cycle:
                self._missed += not self._is_headless
                self._is_headless = True
                return False
        if any(name in self._cycle for name in numbers if name != COUNTER or not layout.is_counted_apart):
            self._damaged += 1
            return False
        return True

    def _begin(self) -> None:
        self._missed += bool(self._cycle)
        self._cycle, self._is_fit, self._is_headless = {}, True, False

    def _whole(self, value: int | float) -> int:
        if isinstance(value, int):
            return value
        steps = value / BINARY_STEP
        if not abs(steps) < MAX_STEPS:  # also for one that is no number
            self._is_fit = False
            return 0
        return round(steps)

    def _is_good(self, row: Numbers) -> bool:
        """Return whether the status of a reading is good and no rate is at the end of its range of codes."""
        if any(row[path] not in good for path, good in self._layout.good.items()):
            return False
        return not any(row[name] in ends for name, ends in self._ranges)
