"""Unit handlers of a bench without simulated units in this process: a person, or a simulator in another process."""

from __future__ import annotations

import socket

from instruments.errors import LinkError, RequestRejected
from instruments.protocols.simulator_control import BUSY, IS_TURNING, OK, mount_line, power_line, turn_line

#: Device name in messages.
DEVICE = "unit handler"


class ManualUnitHandler:
    """A bench on which only a person can turn and switch the units: every request is rejected with that advice."""

    def mount(self, position: str) -> None:
        """Raise RequestRejected: a person has to turn the units."""
        raise RequestRejected(DEVICE, f"only a person can turn the units to {position} up; confirm when it is done")

    def turn(self, position: str, turn_deg: float) -> None:
        """Raise RequestRejected: a person has to turn the units."""
        raise RequestRejected(
            DEVICE, f"only a person can turn the units by {turn_deg:g} deg about {position}; confirm when it is done"
        )

    def is_turning(self) -> bool:
        """Get that nothing is turned here."""
        return False

    def power(self, on: bool) -> None:
        """Raise RequestRejected: a person has to switch the units."""
        raise RequestRejected(
            DEVICE, f"only a person can switch the units {'on' if on else 'off'}; confirm when it is done"
        )


class RemoteUnitHandler:
    """The simulator in another process at `address` (HOST:PORT): one control line per request."""

    TIMEOUT_S = 5.0

    def __init__(self, address: str) -> None:
        host, _, port = address.rpartition(":")
        self._address = (host, int(port))

    def mount(self, position: str) -> None:
        """Turn the units of the simulator. Raises LinkError, RequestRejected."""
        self._request(mount_line(position))

    def turn(self, position: str, turn_deg: float) -> None:
        """Turn the units of the simulator by hand. Raises LinkError, RequestRejected."""
        self._request(turn_line(position, turn_deg))

    def is_turning(self) -> bool:
        """Get whether the simulated hand still turns. Raises LinkError, RequestRejected."""
        return self._request(IS_TURNING, OK, BUSY) == BUSY

    def power(self, on: bool) -> None:
        """Switch the units of the simulator on or off. Raises LinkError, RequestRejected."""
        self._request(power_line(on))

    def _request(self, line: str, *known: str) -> str:
        """Send a line; returns the reply, which is one of `known`, by default `ok`."""
        try:
            with socket.create_connection(self._address, timeout=self.TIMEOUT_S) as link:
                link.sendall(f"{line}\n".encode())
                reply = link.makefile().readline().strip()
        except OSError as error:
            raise LinkError(
                DEVICE, f"the simulator at {self._address} does not answer ({error}); start it with `labctl simulator`"
            ) from error
        if reply not in (known or (OK,)):
            raise RequestRejected(
                DEVICE, f"the simulator answered {reply!r} to {line!r}; start `labctl simulator` again"
            )
        return reply
