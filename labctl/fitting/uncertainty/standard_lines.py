"""Lines of a budget from the reference standards of the bench, and those that are not stated."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from labctl.fitting.data.earth import EARTH_RATE_DPS
from labctl.fitting.uncertainty.budget import BudgetLine
from labctl.fitting.uncertainty.conditions import BenchConditions
from labctl.recording import Standard

RAD_PER_DEG = math.pi / 180.0
#: Quantities whose error is the same at all rates of a campaign, and in proportion to the rate.
COMMON = frozenset({"clock", "table_rate", "turn_angle"})
OWN_THERMOMETER = "cancels: the unit's own thermometer is read in the calibration and in use"
NOT_STATED = "not stated, so its contribution is not in U; add the standard to [[standards]] of the bench file"
NOT_KEPT = "the version was made by an older version of labctl, which did not store its standards: fit it again"
NO_TIME_BASE = (
    "not stated, so its contribution is not in U; if the certificate of table_rate includes the time base, "
    "state the standard with u = 0"
)
NO_LATITUDE = "not known: latitude_deg is not stated, so the Earth's rate is part of the bias"
IN_COEFFICIENTS = "in the coefficients: the fit takes turn_common_u of the recipe"
NO_SENSITIVITY = "its sensitivity is not known: the model has no supply_sensitivity"


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of a result along what a standard can be wrong by, in the unit of the result."""

    relative_rate: float  #: along a relative error of the reference rate
    rate_dps: float  #: along an error of the reference rate, deg/s, that is the same at all rates but rest
    temperature: float  #: per K
    angle: float  #: per radian of the unit against the axis of rotation
    angle_squared: float  #: per square radian: what is left where the first order vanishes
    level: float  #: per deg/s of the Earth's rate along the table axis


#: Quantity and unit -> sensitivity in the unit of the result per unit of the standard; None: not known.
_SENSITIVITY: dict[tuple[str, str], Callable[[Sensitivities, BenchConditions], float | None]] = {
    ("clock", "ppm"): lambda s, _: 1e-6 * s.relative_rate,
    ("table_rate", "ppm"): lambda s, _: 1e-6 * s.relative_rate,
    ("table_rate", "deg/s"): lambda s, _: s.rate_dps,
    ("turn_angle", "deg"): lambda s, _: s.relative_rate / 360.0,
    ("thermometer", "deg C"): lambda s, _: s.temperature,
    ("chamber_gradient", "deg C"): lambda s, _: s.temperature,
    ("fixture_angle", "deg"): lambda s, _: RAD_PER_DEG * s.angle,
    ("tilt", "deg"): lambda s, _: RAD_PER_DEG * s.angle,
    ("level", "deg"): lambda s, c: None if c.latitude_deg is None else s.level * _level_dps_per_deg(c.latitude_deg),
    ("supply", "V"): lambda _, __: None,
}


def _level_dps_per_deg(latitude_deg: float) -> float:
    """Return by how much the Earth's rate along the table axis changes, deg/s per degree that the axis leans north."""
    return EARTH_RATE_DPS * math.cos(math.radians(latitude_deg)) * RAD_PER_DEG


def standard_lines(bench: BenchConditions, s: Sensitivities) -> list[BudgetLine]:
    """Return a line for each standard of the bench, and one for each quantity that should be stated and is not."""
    stated = [_line(each, bench, s) for each in bench.standards if _matters(each.quantity, bench)]
    return [*stated, *_missing(bench)]


def _matters(quantity: str, bench: BenchConditions) -> bool:
    """Return whether a quantity of the bench enters a calibration that was made by such a motion."""
    if quantity in {"clock", "table_rate", "fixture_angle", "tilt"}:
        return bench.motion in {"rates", "profile"}
    return bench.motion == "turns" if quantity == "turn_angle" else True


def _line(standard: Standard, bench: BenchConditions, s: Sensitivities) -> BudgetLine:
    sensitivity = _SENSITIVITY[standard.quantity, standard.unit_name](s, bench)
    why = ""
    if standard.quantity in {"thermometer", "chamber_gradient"} and bench.thermometer == "unit":
        sensitivity, why = 0.0, OWN_THERMOMETER
    elif standard.quantity == "turn_angle" and bench.turn_common_u is not None:
        sensitivity, why = 0.0, IN_COEFFICIENTS
    elif sensitivity is None:
        why = NO_SENSITIVITY if standard.quantity == "supply" else NO_LATITUDE
    u = standard.standard_u
    contribution = None if sensitivity is None else abs(sensitivity) * u
    if standard.quantity in {"fixture_angle", "tilt"} and contribution is not None:
        second = _second_order(abs(s.angle_squared), RAD_PER_DEG * u)
        contribution, why = math.hypot(contribution, second), "with the second order (GUM 5.1.2, note)" * (second > 0)
    return BudgetLine(
        source=standard.quantity,
        name=standard.label,
        kind="B",
        distribution="normal" if standard.half_width is None else standard.distribution,
        u=u,
        unit=standard.unit_name,
        sensitivity=sensitivity,
        contribution=contribution,
        freedom=standard.freedom,
        uncorrected=0.0 if sensitivity is None else sensitivity * standard.uncorrected,
        is_common=standard.quantity in COMMON,
        is_overdue=standard.is_overdue(bench.used_on),
        due=None if standard.due is None else standard.due.isoformat(),
        why=why,
    )


def _second_order(per_square_radian: float, u_rad: float) -> float:
    """Return the root mean square of c (a^2 + b^2) for two tilts of standard uncertainty u: what a cosine loses.

    Mean 2 c u^2 and standard deviation 2 c u^2 of two normal tilts; nothing corrects for the mean, so both count.
    """
    return math.sqrt(8.0) * per_square_radian * u_rad**2


def _missing(bench: BenchConditions) -> list[BudgetLine]:
    """Return a line of unknown size for each quantity that the motion needs and that no standard states."""
    needed = {"rates": ["clock", "fixture_angle"], "profile": ["clock", "fixture_angle"], "turns": ["turn_angle"]}
    quantities = list(needed.get(bench.motion, []))
    if bench.turn_common_u is not None:
        quantities = []
    if bench.thermometer != "unit":
        quantities += ["thermometer", "chamber_gradient"]
    quantities += ["level"] if bench.motion != "poses" else []
    missing = [name for name in quantities if not bench.of(name)]
    lines = [
        _unknown(name, NO_TIME_BASE if name == "clock" and bench.of("table_rate") else NOT_STATED) for name in missing
    ]
    if bench.latitude_deg is None and bench.motion != "poses":
        lines.append(_unknown("earth_rate", NO_LATITUDE))
    return lines


def no_conditions() -> BudgetLine:
    """Return the line of a version whose standards are not known."""
    return _unknown("standards", NOT_KEPT)


_UNITS = {"standards": "", "clock": "ppm", "thermometer": "deg C", "chamber_gradient": "deg C", "earth_rate": "deg/s"}


def _unknown(source: str, why: str) -> BudgetLine:
    return BudgetLine(
        source, source, "B", "", None, _UNITS.get(source, "deg"), None, None, is_common=source in COMMON,
        is_stated=False, why=why,
    )  # fmt: skip
