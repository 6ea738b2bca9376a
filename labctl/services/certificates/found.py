"""What the recordings of a version show, as its certificate needs it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from labctl.certificates.document import Condition
from labctl.services.certificates import measured, remedies
from labctl.services.certificates.facts import Facts
from labctl.services.certificates.missing import MissingFact
from labctl.services.criticism.measurements import Measurements
from labctl.services.room_environment import of_campaign
from labctl.store import Store


@dataclass(frozen=True)
class Found:
    """What the recordings of a version show."""

    measurements: Measurements | None = None  #: None: there are none
    results: measured.Results = field(default_factory=measured.Results)
    conditions: tuple[Condition, ...] = ()
    room: tuple[Condition, ...] = ()
    imported: bool = False  #: whether the newest recording was imported

    @staticmethod
    def of(store: Store, facts: Facts) -> Found:
        """Return what the recordings of a version show; nothing where none of them holds measurements."""
        if not facts.recordings:
            return Found()
        measurements = Measurements(store, facts.recordings)
        results = measured.results(store, facts.row, facts.calibration)
        spans = [] if facts.campaign is None else of_campaign(store, facts.campaign.id)
        room = measured.environment_of_room(spans, facts.order.environment)
        return Found(measurements, results, measured.environment(measurements), room, facts.imported)

    def missing(self) -> Iterator[MissingFact]:
        """Yield what is not known of the results, and what makes it known."""
        for each in self.results.missing():
            yield each._replace(remedy=remedies.of_uncertainty(each.where, self.imported))
        if self.measurements is not None and not any(condition.unit == "°C" for condition in self.conditions):
            yield MissingFact(
                "temperature of the item or of the chamber",
                "a recording with temperature_c or chamber_c",
                remedy=remedies.NO_TEMPERATURE,
            )
