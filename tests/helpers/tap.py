"""A tap on the wire to a simulated instrument: what was sent, byte by byte."""

from __future__ import annotations

from instruments.simulators.links.device import SimulatedDevice


class Tap:
    """Passes bytes on and remembers them."""

    def __init__(self, device: SimulatedDevice) -> None:
        self.device = device
        self.heard: list[bytes] = []
        self.heard_s: list[float] = []
        self.said: list[bytes] = []

    def receive(self, data: bytes, t_s: float) -> None:
        self.heard.append(data)
        self.heard_s.append(t_s)
        self.device.receive(data, t_s)

    def transmit(self, t_s: float) -> bytes:
        data = self.device.transmit(t_s)
        if data:
            self.said.append(data)
        return data

    def skip(self, t_s: float) -> None:
        self.device.skip(t_s)

    def next_byte_s(self, t_s: float) -> float | None:
        return self.device.next_byte_s(t_s)

    def exchanges(self) -> list[tuple[bytes, bytes]]:
        return list(zip(self.heard, self.said, strict=True))

    def forget(self) -> None:
        self.heard.clear()
        self.heard_s.clear()
        self.said.clear()
