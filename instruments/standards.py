"""Reference standards of a bench (VIM 5.6): what its quantities are known from, and how well.

A standard states facts of a certificate: nothing here corrects a reading. Its uncertainty goes into the budget of every
calibration that is made on the bench.
"""

from __future__ import annotations

import math
from datetime import date
from typing import Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, model_validator

#: clock: the time base that rates follow from. table_rate: the table's rate beside its time base. thermometer: the
#: temperature that units are fitted by. chamber_gradient: the unit's temperature against that thermometer.
#: fixture_angle: the unit's axis against its mounting, of each face. tilt: the mounting plate against the axis of
#: rotation. mounting_repeatability: the unit in one mounting against the same mounting another time.
#: tilted_fixture_angle: the unit's direction in a tilted mounting against the one that is stated, in each of two
#: directions. radius: the unit's distance from the axis of rotation, all radii alike. level: the axis of rotation
#: against the vertical. turn_angle: of a turn by hand.
Quantity = Literal[
    "clock", "table_rate", "thermometer", "chamber_gradient", "fixture_angle", "tilt", "mounting_repeatability",
    "tilted_fixture_angle", "radius", "level", "supply", "turn_angle",
]  # fmt: skip
Unit = Literal["ppm", "deg/s", "deg C", "deg", "m", "V"]
Distribution = Literal["normal", "rectangular", "triangular", "u-shaped"]

#: The units that a quantity may be stated in, the usual one first.
UNITS: dict[Quantity, tuple[Unit, ...]] = {
    "clock": ("ppm",),
    "table_rate": ("ppm", "deg/s"),
    "thermometer": ("deg C",),
    "chamber_gradient": ("deg C",),
    "fixture_angle": ("deg",),
    "tilt": ("deg",),
    "mounting_repeatability": ("deg",),
    "tilted_fixture_angle": ("deg",),
    "radius": ("m",),
    "level": ("deg",),
    "supply": ("V",),
    "turn_angle": ("deg",),
}
#: Half-width over standard uncertainty (GUM 4.3.7, 4.3.9; EA-4/02 S 3.3).
HALF_WIDTHS: dict[Distribution, float] = {
    "rectangular": math.sqrt(3.0),
    "triangular": math.sqrt(6.0),
    "u-shaped": math.sqrt(2.0),
}
#: Traceability of the standards of a simulated bench, also where its recording was exported and imported.
SIMULATED = "none: simulated"
#: The standard by which rates are known where each campaign measures the step clock of its table by timed runs.
MEASURED_STEP_CLOCK = "step clock as each campaign measures it"


class Standard(BaseModel):
    """One reference standard: quantity, uncertainty, certificate and dates.

    The uncertainty is given in one of three ways: `u`; `expanded` with its `k`; `half_width` with `distribution`.
    """

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True, allow_inf_nan=False)

    quantity: Quantity
    unit: Unit | None = None  #: None: the usual one of the quantity
    name: str = ""  #: of the instrument or artefact
    #: Known error of the bench, indicated minus true. labctl corrects no reading by it: unless `corrected` says that
    #: the bench does (step_clock_hz, corrections of a reference), its full size is added to U (GUM F.2.4.5).
    value: float | None = None
    corrected: bool = False
    u: float | None = Field(default=None, ge=0)  #: standard uncertainty
    expanded: float | None = Field(default=None, ge=0)  #: expanded uncertainty of a certificate
    k: float = Field(default=2.0, gt=0)  #: coverage factor of `expanded`
    half_width: float | None = Field(default=None, ge=0)  #: of limits
    distribution: Distribution = "normal"
    freedom: float | None = Field(default=None, gt=0)  #: degrees of freedom; None: infinite
    certificate: str = ""  #: number
    issued_by: str = ""
    calibrated: date | None = None
    due: date | None = None  #: the last day on which it may be used
    traceability: str = ""

    @model_validator(mode="after")
    def _one_uncertainty(self) -> Standard:
        names = [name for name in ("u", "expanded", "half_width") if getattr(self, name) is not None]
        if len(names) != 1:
            stated = " and ".join(names) or "none"
            raise ValueError(
                f"standard {self.quantity}: {stated} of the keys u, expanded and half_width are given; give "
                f"exactly one, in {UNITS[self.quantity][0]}"
            )
        if self.half_width is not None and self.distribution not in HALF_WIDTHS:
            raise ValueError(
                f"standard {self.quantity}: half_width = {self.half_width:g} is not defined for a normal "
                f"distribution; set distribution to one of {', '.join(HALF_WIDTHS)}"
            )
        return self

    @model_validator(mode="after")
    def _usable(self) -> Standard:
        allowed = UNITS[self.quantity]
        if self.unit is not None and self.unit not in allowed:
            raise ValueError(
                f"standard {self.quantity}: unit {self.unit!r} is not accepted; give the "
                f"uncertainty in {' or '.join(allowed)}"
            )
        if self.calibrated is not None and self.due is not None and self.due < self.calibrated:
            raise ValueError(
                f"standard {self.quantity}: due {self.due} is before calibrated {self.calibrated}; correct the dates"
            )
        return self

    @property
    def unit_name(self) -> Unit:
        """Unit of `value` and of every uncertainty."""
        return self.unit or UNITS[self.quantity][0]

    @property
    def standard_u(self) -> float:
        """Standard uncertainty in `unit_name`."""
        if self.half_width is not None:
            return self.half_width / HALF_WIDTHS[self.distribution]
        return self.expanded / self.k if self.expanded is not None else self.u or 0.0

    @property
    def uncorrected(self) -> float:
        """Known error that no reading is corrected by, in `unit_name`."""
        return 0.0 if self.corrected else self.value or 0.0

    def is_overdue(self, on: date) -> bool:
        """Return whether its due date is before a day; False where it has none."""
        return self.due is not None and self.due < on

    @property
    def label(self) -> str:
        """Name for a sentence: quantity, instrument and certificate."""
        parts = [self.name, f"certificate {self.certificate}" if self.certificate else ""]
        described = ", ".join(part for part in parts if part)
        return f"{self.quantity} ({described})" if described else self.quantity


def quantities() -> tuple[Quantity, ...]:
    """Return every quantity that a standard may be of."""
    return get_args(Quantity)
