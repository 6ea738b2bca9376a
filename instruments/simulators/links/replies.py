"""Replies of a simulated instrument that sends only when it was asked: at once, or each at its time."""

from __future__ import annotations


class Replies:
    """The sending side of such an instrument: `_out` is sent the next time the link is read."""

    def __init__(self) -> None:
        self._out = bytearray()

    def transmit(self, t_s: float) -> bytes:  # noqa: ARG002  a reply goes out at once
        """Return the replies."""
        sent, self._out = bytes(self._out), bytearray()
        return sent

    def skip(self, t_s: float) -> None:
        """Drop the replies."""
        self.transmit(t_s)

    def next_byte_s(self, t_s: float) -> float | None:  # noqa: ARG002
        """Return None: the instrument sends only replies."""
        return None


class TimedReplies:
    """The sending side of an instrument whose replies are due at a time."""

    def __init__(self) -> None:
        self._queue: list[tuple[float, bytes]] = []

    def send_at(self, due_s: float, data: bytes) -> None:
        """Send a reply at a time."""
        self._queue.append((due_s, data))

    def send_in_order(self, due_s: float, data: bytes) -> None:
        """Send a reply at a time, and not before those that were queued earlier."""
        self.send_at(max([due_s, *(each_s for each_s, _ in self._queue)]), data)

    def forget_replies(self) -> None:
        """Send none of the replies that are queued."""
        self._queue.clear()

    def transmit(self, t_s: float) -> bytes:
        """Return the replies that are due, in the order in which they were queued."""
        due = b"".join(data for due_s, data in self._queue if due_s <= t_s)
        self._queue = [reply for reply in self._queue if reply[0] > t_s]
        return due

    def skip(self, t_s: float) -> None:
        """Drop the replies that are due."""
        self.transmit(t_s)

    def next_byte_s(self, t_s: float) -> float | None:  # noqa: ARG002  the times of all replies are known
        """Return when the next reply is due."""
        return min((due_s for due_s, _ in self._queue), default=None)
