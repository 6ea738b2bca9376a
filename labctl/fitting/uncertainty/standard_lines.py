"""Lines of a budget from the reference standards of the bench, and those that are not stated."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.data.earth_rate import EARTH_RATE_DPS
from labctl.fitting.data.mounting_angles import ANGLE_QUANTITIES, AngleGains, separates_any
from labctl.fitting.data.tilted_mountings import TILTED
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.uncertainty.budget import BudgetLine
from labctl.fitting.uncertainty.conditions import BenchConditions
from labctl.recording import Standard
from labctl.recording.positions import Position

RAD_PER_DEG = math.pi / 180.0
#: Quantities whose error is the same at all rates of a campaign, and in proportion to the rate.
COMMON = frozenset({"clock", "table_rate", "turn_angle"})
OWN_THERMOMETER = "cancels: the unit's own thermometer is read in the calibration and in use"
#: The line of the Earth's rate where it is part of the bias.
EARTH_RATE = "earth_rate"
NOT_STATED = "not stated, so its contribution is not in U"
NOT_KEPT = "the version was made by an older version of labctl, which did not store its standards: fit it again"
NO_TIME_BASE = (
    "not stated, so its contribution is not in U; if the certificate of table_rate includes the time base, "
    "state the standard with u = 0"
)
NO_LATITUDE = "not known: latitude_deg is not stated, so the Earth's rate is part of the bias"
SECOND = "with the second order (GUM 5.1.2, note)"
BESIDE_STRAIGHT = "separated from the coefficients by the mountings with each body axis up"
PLACED_IN_COEFFICIENTS = "in the coefficients, about the axes whose mountings separate angles"
IN_COEFFICIENTS = "in the coefficients: the fit takes turn_common_u of the recipe"
OF_COEFFICIENTS = "in the coefficients of g-sensitivity that were found by the centripetal acceleration, not in a rate"
NO_SENSITIVITY = "its sensitivity is not known: the model has no supply_sensitivity"


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of n results along what a standard can be wrong by, in their unit; (n, m) for m independent errors.

    One error that all results share has one column; the angles of the mountings have one for each of their directions.
    """

    relative_rate: Array  #: (n, 1) along a relative error of the reference rate
    rate_dps: Array  #: (n, 1) along an error of the reference rate, deg/s, that is the same at all rates but rest
    temperature: Array  #: (n, 1) per K
    angles: Mapping[str, Array]  #: quantity -> (n, m) per radian of such angles of the mountings
    level: Array  #: (n, 1) per deg/s of the Earth's rate along the table axis
    angle_squared: Array  #: (n,) per square radian: what is left where the first order vanishes

    @staticmethod
    def of_one(
        *,
        relative_rate: float = 0.0,
        rate_dps: float = 0.0,
        temperature: float = 0.0,
        angle: float = 0.0,
        gains: AngleGains | None = None,
        angle_squared: float = 0.0,
        level: float = 0.0,
    ) -> Sensitivities:
        """Return those of a single result, 0 where not named; `gains` is how `angle` follows each kind of angle."""
        arrays = [np.full((1, 1), each) for each in (relative_rate, rate_dps, temperature, level)]
        gains = gains or AngleGains()
        angles = {name: np.full((1, 1), angle * gains.of(name)) for name in EVERY_ANGLE}
        return Sensitivities(arrays[0], arrays[1], arrays[2], angles, arrays[3], np.array([angle_squared]))


@dataclass(frozen=True)
class SourceLines:
    """One source of uncertainty of n results: a line for each of them, and what it adds to their covariance."""

    lines: tuple[BudgetLine, ...]
    covariance: Array  #: (n, n); zero where the source is unknown


EVERY_ANGLE = (*ANGLE_QUANTITIES, TILTED)

#: Quantity and unit -> sensitivity in the unit of the result per unit of the standard; None: not known.
_SENSITIVITY: dict[tuple[str, str], Callable[[Sensitivities, BenchConditions], Array | None]] = {
    ("clock", "ppm"): lambda s, _: 1e-6 * s.relative_rate,
    ("table_rate", "ppm"): lambda s, _: 1e-6 * s.relative_rate,
    ("table_rate", "deg/s"): lambda s, _: s.rate_dps,
    ("turn_angle", "deg"): lambda s, _: s.relative_rate / 360.0,
    ("thermometer", "deg C"): lambda s, _: s.temperature,
    ("chamber_gradient", "deg C"): lambda s, _: s.temperature,
    ("fixture_angle", "deg"): lambda s, _: RAD_PER_DEG * s.angles["fixture_angle"],
    ("tilt", "deg"): lambda s, _: RAD_PER_DEG * s.angles["tilt"],
    ("mounting_repeatability", "deg"): lambda s, _: RAD_PER_DEG * s.angles["mounting_repeatability"],
    (TILTED, "deg"): lambda s, _: RAD_PER_DEG * s.angles[TILTED],
    ("radius", "m"): lambda s, _: np.zeros_like(s.relative_rate),
    ("level", "deg"): lambda s, c: None if c.latitude_deg is None else s.level * _level_dps_per_deg(c.latitude_deg),
    ("supply", "V"): lambda _, __: None,
}


def _level_dps_per_deg(latitude_deg: float) -> float:
    """Return by how much the Earth's rate along the table axis changes, deg/s per degree that the axis leans north."""
    return EARTH_RATE_DPS * math.cos(math.radians(latitude_deg)) * RAD_PER_DEG


def standard_lines(bench: BenchConditions | None, s: Sensitivities) -> list[SourceLines]:
    """Return the lines of each standard of the bench, and of each quantity that should be stated and is not.

    None: an older version of labctl, which did not store the standards, made the version.
    """
    n = len(s.angle_squared)
    if bench is None:
        return [_of_all(_unknown("standards", NOT_KEPT), n)]
    stated_lines = [
        _of_standard(standard, bench, s) for standard in bench.standards if _matters(standard.quantity, bench)
    ]
    return [*stated_lines, *(_of_all(line, n) for line in _missing(bench))]


def standards_u(bench: BenchConditions, s: Sensitivities) -> float:
    """Return the standard uncertainty of a single result by all standards that the bench states, in its unit."""
    return math.sqrt(sum(float(source.covariance[0, 0]) for source in standard_lines(bench, s)))


def _of_all(line: BudgetLine, n: int) -> SourceLines:
    return SourceLines((line,) * n, np.zeros((n, n)))


def _matters(quantity: str, bench: BenchConditions) -> bool:
    """Return whether a quantity of the bench enters a calibration that was made by such a motion."""
    if quantity == TILTED:
        return bench.motion in {"rates", "profile"} and any(Position.of(each).is_tilted for each in bench.mountings)
    if quantity in {"clock", "table_rate", "radius", *ANGLE_QUANTITIES}:
        return bench.motion in {"rates", "profile"}
    return bench.motion == "turns" if quantity == "turn_angle" else True


def _of_standard(standard: Standard, bench: BenchConditions, s: Sensitivities) -> SourceLines:
    sensitivity, reason = _sensitivity(standard, bench, s)
    n, u = len(s.angle_squared), standard.standard_u
    if sensitivity is None:
        line = _line(standard, bench, None, None, reason)
        return SourceLines((line,) * n, np.zeros((n, n)))
    second = np.zeros(n)
    if standard.quantity in ANGLE_QUANTITIES:
        second = _second_order(np.abs(s.angle_squared), RAD_PER_DEG * u)
    covariance = u**2 * sensitivity @ sensitivity.T + np.diag(second**2)
    lines = tuple(
        _line(
            standard,
            bench,
            _size(sensitivity[row]),
            math.sqrt(covariance[row, row]),
            reason or SECOND * int(second[row] > 0),
            tuple(part for part in (*(u * sensitivity[row]).tolist(), float(second[row])) if part),
        )
        for row in range(n)
    )
    return SourceLines(lines, covariance)


def _sensitivity(standard: Standard, bench: BenchConditions, s: Sensitivities) -> tuple[Array | None, str]:
    """Return how the results follow errors of a standard, (n, m), None where that is not known; and why it is so."""
    if standard.quantity in {"thermometer", "chamber_gradient"} and bench.thermometer == "unit":
        return np.zeros_like(s.temperature), OWN_THERMOMETER
    if standard.quantity == "turn_angle" and bench.turn_common_u is not None:
        return np.zeros_like(s.relative_rate), IN_COEFFICIENTS
    if standard.quantity == "radius":
        return np.zeros_like(s.relative_rate), OF_COEFFICIENTS
    if standard.quantity in EVERY_ANGLE and (reason := _why_less(standard.quantity, bench)):
        return _SENSITIVITY[standard.quantity, standard.unit_name](s, bench), reason
    sensitivity = _SENSITIVITY[standard.quantity, standard.unit_name](s, bench)
    if sensitivity is None:
        return None, NO_SENSITIVITY if standard.quantity == "supply" else NO_LATITUDE
    return sensitivity, ""


def _why_less(quantity: str, bench: BenchConditions) -> str:
    """Return why an angle of the mountings is smaller in the result than it is stated; empty where it is not."""
    if quantity == TILTED:
        return "" if bench.has_tilted else BESIDE_STRAIGHT
    if not bench.separates or not any(separates_any(bench.mountings, axis) for axis in BODY_AXES):
        return ""
    if quantity == "mounting_repeatability":
        return PLACED_IN_COEFFICIENTS
    return f"as far as the mountings {', '.join(sorted(bench.mountings))} do not separate it from the misalignment"


def _size(sensitivity: Array) -> float:
    """Return the sensitivity of one result (m,) along one error with its sign, along several their root sum square."""
    return float(sensitivity[0]) if len(sensitivity) == 1 else float(np.linalg.norm(sensitivity))


def _line(
    standard: Standard, bench: BenchConditions, sensitivity: float | None, contribution: float | None, reason: str,
    parts: tuple[float, ...] = (),
) -> BudgetLine:  # fmt: skip
    return BudgetLine(
        source=standard.quantity,
        name=standard.label,
        kind="B",
        distribution="normal" if standard.half_width is None else standard.distribution,
        u=standard.standard_u,
        unit=standard.unit_name,
        sensitivity=sensitivity,
        contribution=contribution,
        freedom=standard.freedom,
        uncorrected=0.0 if sensitivity is None else sensitivity * standard.uncorrected,
        is_common=standard.quantity in COMMON,
        is_overdue=standard.is_overdue(bench.used_on),
        due=None if standard.due is None else standard.due.isoformat(),
        why=reason,
        parts=parts,
    )


def _second_order(per_square_radian: Array, u_rad: float) -> Array:
    """Return the root mean square of c (a^2 + b^2) for two tilts of standard uncertainty u: what a cosine loses.

    Mean 2 c u^2 and standard deviation 2 c u^2 of two normal tilts; nothing corrects for the mean, so both count.
    """
    return np.asarray(math.sqrt(8.0) * per_square_radian * u_rad**2)


def _missing(bench: BenchConditions) -> list[BudgetLine]:
    """Return a line of unknown size for each quantity that the motion needs and that no standard states."""
    needed = {"rates": ["clock", "fixture_angle"], "profile": ["clock", "fixture_angle"], "turns": ["turn_angle"]}
    quantities = list(needed.get(bench.motion, []))
    if bench.turn_common_u is not None:
        quantities = []
    if bench.thermometer != "unit":
        quantities += ["thermometer", "chamber_gradient"]
    quantities += ["level"] if bench.motion != "poses" else []
    if any(
        Position.of(mounting).turned_deg for mounting in bench.mountings
    ):  # then little else is left of these angles
        quantities.append("mounting_repeatability")
    quantities += [TILTED] if bench.has_tilted else []
    missing = [name for name in quantities if not bench.of(name)]
    lines = [
        _unknown(name, NO_TIME_BASE if name == "clock" and bench.of("table_rate") else NOT_STATED) for name in missing
    ]
    if bench.latitude_deg is None and bench.motion != "poses":
        lines.append(_unknown(EARTH_RATE, NO_LATITUDE))
    return lines


_UNITS = {"standards": "", "clock": "ppm", "thermometer": "deg C", "chamber_gradient": "deg C", EARTH_RATE: "deg/s"}


def _unknown(source: str, reason: str) -> BudgetLine:
    return BudgetLine(
        source, source, "B", "", None, _UNITS.get(source, "deg"), None, None, is_common=source in COMMON,
        is_stated=False, why=reason,
    )  # fmt: skip
