"""The messages of a damaged ULog: which bytes are sound, found again after each damage, without a library.

A message is its size (2 bytes), its type (1) and a body. Data of one subscription always have one size, and a reading
follows its subscription, so that a place where several such messages follow each other is no chance.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from labctl.recording.unread import Unread

#: Length of the header of the file, and of a message.
HEADER, MESSAGE = 16, 3
DATA, SUBSCRIPTION, FLAGS, SYNC = ord("D"), ord("A"), ord("B"), ord("S")
#: ULog format, "Message types".
KINDS = frozenset(b"FIMPQABRDLCSO")
SYNC_BODY = bytes([0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12])
#: So many messages in a row show where a log goes on after damage.
IN_A_ROW = 4
#: What is searched for such a place, bytes; beyond it the rest is lost.
MOST_SEARCHED = 1 << 24
#: Bodies have at least so many bytes: number and time; instance, number and a name.
LEAST_DATA, LEAST_SUBSCRIPTION = 10, 4
#: A message of another kind than data is shorter than this, bytes.
LONGEST = 10_000


@dataclass
class _Walk:
    """Positions of the sound messages, and what the log has said so far."""

    content: bytes
    sizes: dict[int, int] = field(default_factory=dict)  #: subscription -> size of its data; 0: none seen yet
    last_us: int = 0

    def end_of(self, at: int) -> int:
        """Return where a message ends that may be sound; 0 where it is not."""
        content = self.content
        if at + MESSAGE >= len(content):
            return 0
        size, kind = content[at] | content[at + 1] << 8, content[at + 2]
        end = at + MESSAGE + size
        if size == 0 or end > len(content) or kind not in KINDS:
            return 0
        if kind == DATA:
            is_sound = size >= LEAST_DATA and self.sizes.get(content[at + 3] | content[at + 4] << 8) in (0, size)
        elif kind == SYNC:
            is_sound = content[at + MESSAGE : end] == SYNC_BODY
        elif kind == SUBSCRIPTION:
            is_sound = size >= LEAST_SUBSCRIPTION and content[at + MESSAGE + 3 : end].isascii()
        else:
            is_sound = size < LONGEST
        return end if is_sound else 0

    def take(self, at: int) -> None:
        """Take in a sound message."""
        content = self.content
        size, kind = content[at] | content[at + 1] << 8, content[at + 2]
        if kind == DATA:
            self.sizes[content[at + 3] | content[at + 4] << 8] = size
            self.last_us = int.from_bytes(content[at + 5 : at + 13], "little")
        elif kind == SUBSCRIPTION:
            self.sizes.setdefault(content[at + 4] | content[at + 5] << 8, 0)

    def goes_on(self, after: int) -> int:
        """Return the first place at or after one where messages follow each other again; the end without one."""
        end = len(self.content)
        for at in range(after, min(end, after + MOST_SEARCHED)):
            place = at
            for _ in range(IN_A_ROW):
                place = self.end_of(place)
                if place in (0, end):
                    break
            if place:
                return at
        return end


@dataclass(frozen=True)
class Gap:
    """Bytes of a log that are no messages, and the times about them, us since boot; None: no reading follows."""

    start: int
    end: int
    before_us: int
    after_us: int | None


def sound_bytes(content: bytes) -> tuple[bytes, Unread | None]:
    """Return the header and the sound messages of a log, and what is none; itself, and None, where all is sound.

    The message before a gap is left out where it holds data: its end may be damaged too.
    """
    kept, gaps = list[tuple[int, int]](), list[Gap]()
    for start, end, gap in _runs(content):
        kept.append((start, end))
        if gap is not None:
            gaps.append(gap)
    if not gaps:
        return content, None
    body = b"".join(content[start:end] for start, end in kept)
    size = int.from_bytes(body[:2], "little")
    if body[2:3] == bytes([FLAGS]):  # the places of appended data that it states are others now
        body = body[MESSAGE + size :]
    lost = sum(gap.end - gap.start for gap in gaps)
    cut = gaps[-1].end == len(content)
    return content[:HEADER] + body, Unread(lost / len(content), tuple(map(_said, gaps)), is_cut=cut)


def _runs(content: bytes) -> Iterator[tuple[int, int, Gap | None]]:
    """Yield the stretches of sound messages, (first byte, end), each with the gap that follows it."""
    walk, start, at, last = _Walk(content), HEADER, HEADER, -1
    while at < len(content):
        end = walk.end_of(at)
        if end:
            before_us, last = walk.last_us, at
            walk.take(at)
            at = end
            continue
        if last >= start and content[last + 2] == DATA:
            at, walk.last_us = last, before_us
        found = walk.goes_on(at + 1 if at != last else at + MESSAGE)
        gap = Gap(at, found, walk.last_us, None)
        if found < len(content):
            walk.take(found)
            gap = Gap(at, found, gap.before_us, walk.last_us)
        yield start, at, gap
        start = at = found
        last = -1
    if at > start:
        yield start, at, None


def _said(gap: Gap) -> str:
    until = "to the end" if gap.after_us is None else f"to {gap.after_us / 1e6:.3f} s"
    return f"bytes {gap.start} to {gap.end} ({gap.before_us / 1e6:.3f} s {until} of its clock)"
