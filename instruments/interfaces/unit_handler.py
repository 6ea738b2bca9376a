"""What a person's hand does to the units: turn them, switch them. In simulation the hand reaches into the world."""

from __future__ import annotations

import socket
from typing import TYPE_CHECKING, Protocol

from instruments.clock import Clock
from instruments.errors import LinkError, RequestRejected

if TYPE_CHECKING:
    from instruments.transport.factory import Simulation


class UnitHandler(Protocol):
    """Somebody, or something, that can turn and switch the units."""

    def mount(self, position: str) -> None:
        """Control the units: turn them so that body axis `position` points up along the table axis."""
        ...

    def power(self, on: bool) -> None:
        """Control the units: switch them on or off."""
        ...


class ManualUnitHandler:
    """A bench on which only a person can do it."""

    def mount(self, position: str) -> None:
        """Control nothing: a person has to turn the units."""
        raise RequestRejected("hand", f"only a person can turn the units to {position} up; confirm when it is done")

    def power(self, on: bool) -> None:
        """Control nothing: a person has to switch the units."""
        raise RequestRejected(
            "hand", f"only a person can switch the units {'on' if on else 'off'}; confirm when it is done"
        )


class SimulatedUnitHandler:
    """Reaches into the simulated world of this process."""

    def __init__(self, simulation: Simulation, clock: Clock) -> None:
        self._world = simulation.world
        self._clock = clock

    def mount(self, position: str) -> None:
        """Control the world: turn its units."""
        self._world.mount(self._clock.now_s(), position)

    def power(self, on: bool) -> None:
        """Control the world: switch its units."""
        self._world.power(self._clock.now_s(), on)


class RemoteUnitHandler:
    """Asks the simulator in another process, one line of text per act."""

    TIMEOUT_S = 5.0

    def __init__(self, address: str) -> None:
        host, _, port = address.rpartition(":")
        self._address = (host, int(port))

    def mount(self, position: str) -> None:
        """Control the simulator: turn its units."""
        self._ask(f"mount {position}")

    def power(self, on: bool) -> None:
        """Control the simulator: switch its units."""
        self._ask(f"power {'on' if on else 'off'}")

    def _ask(self, line: str) -> None:
        try:
            with socket.create_connection(self._address, timeout=self.TIMEOUT_S) as link:
                link.sendall(f"{line}\n".encode())
                answer = link.makefile().readline().strip()
        except OSError as error:
            raise LinkError("hand", f"the simulator at {self._address} does not answer ({error})") from error
        if answer != "ok":
            raise RequestRejected("hand", f"the simulator answered {answer!r} to {line!r}")
