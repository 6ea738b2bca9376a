"""What a budget knows of the bench: its reference standards, and what their sensitivities depend on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date
from typing import Literal

from labctl.answers.budget import BenchConditionsJson
from labctl.answers.fitted_model import FitEnvironment
from labctl.fitting.data.mounting_angles import AngleGains, angle_gains, placed_rad, separates_any
from labctl.fitting.data.tilted_mountings import element_gain, has_tilted
from labctl.recording import RecordingInfo, Standard

Thermometer = Literal["unit", "chamber", "reference"]


@dataclass(frozen=True)
class BenchConditions:
    """Standards and circumstances of the recordings that a calibration was fitted to."""

    used_on: date  #: day of the newest recording
    motion: str = "rates"
    thermometer: Thermometer = "unit"
    latitude_deg: float | None = None
    turn_common_u: float | None = None  #: of turns, in the coefficients already
    max_rate_dps: float | None = None
    standards: tuple[Standard, ...] = field(default_factory=tuple)
    mountings: Mapping[str, float] = field(default_factory=dict)  #: position -> its share in the slopes over the rate
    #: Output -> name -> angle of the mountings that the fit separated, rad: of this bench, in these recordings.
    angles_rad: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    separates: bool = True  #: whether angles of the mountings were fitted beside the slopes

    def of(self, quantity: str) -> tuple[Standard, ...]:
        """Return the standards of a quantity."""
        return tuple(standard for standard in self.standards if standard.quantity == quantity)

    def angle_gains(self, axis: str) -> AngleGains:
        """Return how the misalignment towards a body axis follows the angles of its mountings; 1 where not stored.

        What a fit takes as a random effect of each mounting is in the u of its coefficients.
        """
        gains = angle_gains(self.mountings, axis, separates=self.separates)
        return replace(gains, mounting=0.0) if self.fits_placement(axis) else gains

    def fits_placement(self, axis: str) -> bool:
        """Return whether the fit took into account how a unit is placed in each mounting with an axis up."""
        stated = self.separates and placed_rad(self.standards) > 0
        return stated and separates_any(self.mountings, axis)

    @property
    def has_tilted(self) -> bool:
        """Return whether the coefficients have the angles of tilted mountings in them."""
        return has_tilted(self.mountings)

    def element_gains(self, output: str, about: str) -> AngleGains:
        """Return how an element of the matrix follows the angles of mountings, some of them tilted."""
        every = element_gain(self.mountings, output, about)
        fixture, tilted = (element_gain(self.mountings, output, about, tilted=each) for each in (False, True))
        return AngleGains(fixture, every, every, tilted)

    def to_json(self) -> BenchConditionsJson:
        """Return this as JSON."""
        conditions_json: BenchConditionsJson = {
            "used_on": self.used_on.isoformat(), "motion": self.motion, "thermometer": self.thermometer,
            "latitude_deg": self.latitude_deg, "turn_common_u": self.turn_common_u, "max_rate_dps": self.max_rate_dps,
            "stated": [standard.model_dump(mode="json") for standard in self.standards],  # type: ignore[misc]
        }  # fmt: skip
        if self.mountings:
            conditions_json["mountings"] = dict(self.mountings)
        if self.angles_rad:
            conditions_json["angles_rad"] = {axis: dict(named) for axis, named in self.angles_rad.items()}
        return conditions_json

    @staticmethod
    def from_json(record: BenchConditionsJson) -> BenchConditions:
        """Return what `to_json` described."""
        return BenchConditions(
            date.fromisoformat(record["used_on"]), record["motion"], record["thermometer"], record["latitude_deg"],
            record["turn_common_u"], record["max_rate_dps"],
            tuple(Standard.model_validate(each) for each in record["stated"]), record.get("mountings", {}),
            record.get("angles_rad", {}),
        )  # fmt: skip


def conditions_of(
    info: RecordingInfo,
    environment: FitEnvironment,
    used_on: Sequence[date] = (),
    mountings: Mapping[str, float] | None = None,
    angles_rad: Mapping[str, Mapping[str, float]] | None = None,
) -> BenchConditions:
    """Return the conditions of a fit: head of its recording, which thermometer it went by, and the recordings' days.

    `mountings` and `angles_rad` are those of the fit's result.
    """
    thermometer: Thermometer = (
        "reference" if info.thermometer else "chamber" if "temperature" in environment else "unit"
    )
    return BenchConditions(
        max(used_on, default=info.started_at.date()), info.motion, thermometer, info.latitude_deg, info.turn_common_u,
        info.max_rate_dps, info.standards, mountings or {}, angles_rad or {},
    )  # fmt: skip
