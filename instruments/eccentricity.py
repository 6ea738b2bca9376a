"""Where the units are mounted off the axis of the table: their distance from it, and which body axis points away.

At a rate the unit has a centripetal acceleration towards the axis of the table, in proportion to that distance.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, field_validator, model_validator

from instruments.positions import MAX_RADIUS_MM, Position

MM_PER_M = 1000


def _whole_mm(radius_m: float) -> float:
    """Return a distance that is stated to the millimetre; raises ValueError for another one."""
    if abs(radius_m * MM_PER_M - round(radius_m * MM_PER_M)) > 1e-6:
        raise ValueError(f"{radius_m:g} m is no whole number of millimetres; round it, such as {radius_m:.3f}")
    return round(radius_m * MM_PER_M) / MM_PER_M


#: Distance of the middle of a unit from the axis of rotation of the table, m; a recording has it to the millimetre.
RadiusM = Annotated[float, Field(ge=0, le=MAX_RADIUS_MM / MM_PER_M), AfterValidator(_whole_mm)]


class Eccentricity(BaseModel):
    """Distances from the table's axis at which the fixture of a bench holds its units."""

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True, allow_inf_nan=False)

    radius_m: RadiusM  #: as the units are usually mounted
    other_radii_m: tuple[RadiusM, ...] = ()  #: to which a person can move the fixture
    #: What points up -> the level body axis that points away from the table's axis; absent: not known.
    outward: dict[str, str] = Field(default_factory=dict)

    @field_validator("outward")
    @classmethod
    def _level_axes(cls, outward: dict[str, str]) -> dict[str, str]:
        for end, axis in outward.items():
            if Position.of(end).end != end or not _is_level(end, axis):
                raise ValueError(
                    f'outward: {end} = "{axis}": give for what points up, such as z or -x, the level body axis that '
                    'points away from the axis of the table, such as z = "x" or x = "-y"'
                )
        return outward

    @model_validator(mode="after")
    def _differ(self) -> Eccentricity:
        radii_m = [self.radius_m, *self.other_radii_m]
        if twice := next((each for each in radii_m if radii_m.count(each) > 1), None):
            raise ValueError(f"the radius {twice:g} m is given twice; give each radius once, the usual one in radius_m")
        return self

    @property
    def furthest_m(self) -> float | None:
        """The other radius that differs most from the usual one, m; None where there is no other."""
        return max(self.other_radii_m, key=lambda radius_m: abs(radius_m - self.radius_m), default=None)

    def mounted(self, position: str) -> str:
        """Return a position with where its unit is: at the usual radius where it names none."""
        place = Position.of(position)
        radius_mm = round(self.radius_m * MM_PER_M) if place.radius_mm is None else place.radius_mm
        return str(place.at_radius(radius_mm, place.outward or self.outward.get(place.end, "")))


def _is_level(end: str, axis: str) -> bool:
    """Return whether a body axis with its sign is level where an end points up."""
    return axis.removeprefix("-") in {"x", "y", "z"} and axis.removeprefix("-") not in Position.of(end).axes
