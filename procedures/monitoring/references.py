"""What the reference instruments of a bench said last, as values and as columns of readings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from instruments.errors import LinkError
from instruments.interfaces.gyro import Readings
from instruments.interfaces.reference import Reference
from procedures.monitoring.links import LinkStates


class ReferenceWatch:
    """Reads each instrument at every poll; its last answer holds until the next one, for as long as the links allow."""

    def __init__(self, references: Mapping[str, Reference], links: LinkStates) -> None:
        self._references, self._links = references, links
        self._raw: dict[str, int] = {}
        self.values: dict[str, float] = {}  #: column -> value, in the unit of its channel

    def begin(self) -> None:
        """Ask each for the first time; here silence is an error at once. Raises InstrumentError."""
        for reference in self._references.values():
            self._take(reference)

    def poll(self, on_silence: Callable[[str, LinkError], None]) -> None:
        """Ask each; one that is silent is reported, and keeps its last value."""
        for name, reference in self._references.items():
            try:
                self._take(reference)
            except LinkError as error:
                on_silence(name, error)
            else:
                self._links.change(name, "well")

    def beside(self, readings: Readings) -> Readings:
        """Return readings of a unit with a column for each quantity, as it was last read."""
        if not self._raw:
            return readings
        columns = {name: np.full(len(readings), value, dtype=np.int64) for name, value in self._raw.items()}
        return replace(readings, raw={**readings.raw, **columns})

    def _take(self, reference: Reference) -> None:
        raw = reference.read().raw
        self._raw |= raw
        self.values |= {
            channel.name: channel.offset + channel.scale * raw[channel.name] for channel in reference.channels
        }
        self._links.heard(reference.name)
