"""A simulated instrument behind a gRPC server: calls in, replies out."""

from __future__ import annotations

from abc import ABC, abstractmethod

from instruments.simulators.links.faults import Faults
from instruments.simulators.links.replies import Replies
from instruments.simulators.links.rpc_blocks import Call, Reply, reply_block, take_call


class RpcDevice(Replies, ABC):
    """Answers each call at once."""

    #: A server on a real port carries gRPC to it, and no bare bytes.
    is_rpc = True

    def __init__(self, faults: Faults) -> None:
        super().__init__()
        self.faults = faults
        self._pending = b""

    @abstractmethod
    def answer(self, call: Call, t_s: float) -> Reply:
        """Return the reply to a call."""

    def receive(self, data: bytes, t_s: float) -> None:
        """Take bytes and answer every whole call in them; bytes that cannot become a call are dropped."""
        self._pending += data
        try:
            while (received_call := take_call(self._pending)) is not None:
                call, self._pending = received_call
                self._reply_to(call, t_s)
        except ValueError:
            self._pending = b""

    def _reply_to(self, call: Call, t_s: float) -> None:
        reply = self.answer(call, t_s)
        if self.faults.trigger(["lost_reply", "silence"], t_s) is None:
            self._out += reply_block(reply)
