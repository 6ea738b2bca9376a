"""Unit handler of the simulated world in this process."""

from __future__ import annotations

from instruments.clock import Clock
from instruments.simulators.physics.world import World


class SimulatedUnitHandler:
    """Turns and switches the units of the simulated world at the present clock time."""

    def __init__(self, world: World, clock: Clock) -> None:
        self._world = world
        self._clock = clock

    def mount(self, position: str) -> None:
        """Turn the units of the simulated bench."""
        self._world.mount(self._clock.now_s(), position)

    def turn(self, position: str, turn_deg: float) -> None:
        """Have the simulated person turn the units."""
        self._world.turn_by_hand(self._clock.now_s(), position, turn_deg)

    def is_turning(self) -> bool:
        """Get whether the hand still turns."""
        return self._world.hand.is_turning(self._clock.now_s())

    def power(self, on: bool) -> None:
        """Switch the units of the simulated bench on or off."""
        self._world.power(self._clock.now_s(), on)
