"""What gravity and turning off the axis do: specific force is felt as rate."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.effects.base import Column, Effect, Parameter, Reference, Rows, Span, Term, by_parameter
from labctl.fitting.effects.equation import Equation, Source, Symbol, term_528
from labctl.fitting.numeric.arrays import Array
from labctl.recording.positions import Position

if TYPE_CHECKING:
    from labctl.answers.effect_origin import Origin

GRAVITY = 9.80665
#: Specific force along an axis that changes by less, g, is the tilt of a support and the drift of an accelerometer with
#: temperature, tens of mg for a low-cost one (its data sheet), and no change of pose.
MIN_CHANGE_G = 0.1
#: The same of a force that is known from position, rate and distance from the table's axis, and from no accelerometer.
MIN_KNOWN_CHANGE_G = 0.01
#: Between these quantiles of a logged force the change counts, so that a knock does not.
QUANTILES = (0.01, 0.99)


class _Acceleration(Effect):
    origin: ClassVar[Origin] = "sensor"
    in_use = False  # gravity is known from the position on the bench; in use `force_sensitivity` needs an accelerometer
    rows: ClassVar[Rows] = "all"
    shows_at_rest = True

    def undetermined_by(self, channels: Channels, axis: str) -> str:
        changes = {body: change_g(channels, body) for body in self.felt_along(axis)}
        least_g = least_change_g(channels)
        if not changes or max(changes.values()) >= least_g:
            return ""
        changes_text = ", ".join(f"{body} by {change:.2g} g" for body, change in changes.items())
        return (
            f"no change of pose: the specific force changes less than {least_g} g ({changes_text}), as a "
            "support tilts "
            "or an accelerometer drifts; measure each axis up and down"
        )

    def felt_along(self, axis: str) -> tuple[str, ...]:
        """Return the body axes whose force this effect takes for an output axis."""
        return (axis,)


def force_g(channels: Channels, axis: str) -> Array:
    """Return the specific force along a body axis, (n,) g: logged, or what gravity gives in each position.

    Where the position says how far the unit is from the table's axis, and which body axis points away from it, that is
    with the centripetal acceleration, towards the table's axis.
    """
    name = f"accel_{axis}_g"
    if name in channels:
        return np.asarray(channels[name], dtype=np.float64)
    return channels.up(axis) - np.nan_to_num(pull_g(channels, channels.lever_m(axis)))


def pull_g(channels: Channels, distance_m: Array | float) -> Array:
    """Return the centripetal acceleration, (n,) g, at a distance from the table's axis, (n,) m."""
    if "table_rate_dps" not in channels:
        return np.full(len(channels), np.nan)
    return np.asarray(np.deg2rad(channels.table_rate_dps()) ** 2 * distance_m / GRAVITY)


def knows_pull(channels: Channels) -> bool:
    """Return whether the specific force is known with the centripetal acceleration: in all rows that turn, or none."""
    lever_m = channels.lever_m(BODY_AXES[0])
    return "table_rate_dps" in channels and bool(np.any(np.isfinite(lever_m) & (channels.table_rate_dps() != 0)))


def least_change_g(channels: Channels) -> float:
    """Return by how much a specific force has to change, g, to determine a sensitivity to it."""
    logged = any(f"accel_{axis}_g" in channels for axis in BODY_AXES)
    return MIN_CHANGE_G if logged or not knows_pull(channels) else MIN_KNOWN_CHANGE_G


def change_g(channels: Channels, axis: str) -> float:
    """Return by how much the specific force along a body axis changes, g; of a logged one but for outermost values."""
    if len(channels) == 0:
        return 0.0
    if f"accel_{axis}_g" in channels:
        return float(np.diff(np.quantile(force_g(channels, axis), QUANTILES))[0])
    return float(np.ptp(force_g(channels, axis)))


class GSensitivity(_Acceleration):
    """Linear g-sensitivity."""

    id = "g_sensitivity"
    term = "Acceleration-sensitive drift (g-sensitivity)"
    sentence = "The bias changes with gravity along the gyro's own axis: it differs between up and down."
    ranges: ClassVar = {"fog": (0.0, 1e-3), "mems": (0.0, 0.1), "piezo": (0.0, 0.2)}
    experiment = "each axis up and down within the same powered run"
    draws = ("map", "time")
    equation: ClassVar = Equation(
        "D * f[a]",
        (Symbol("D", "g-sensitivity along the own axis", "deg/s/g", "g_own"),),
    )
    sources: ClassVar = (term_528("acceleration-sensitive drift rate"),)

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        return [Column("g_own", "deg/s/g", force_g(channels, axis))]


class CrossGSensitivity(_Acceleration):
    """Cross-axis g-sensitivity."""

    id = "cross_g_sensitivity"
    term = "Acceleration-sensitive drift, cross-axis"
    sentence = "The bias changes with gravity along the other axes."
    ranges: ClassVar = {"fog": (0.0, 1e-3), "mems": (0.0, 0.1), "piezo": (0.0, 0.2)}
    experiment = "a tumble over six faces within the same powered run"
    draws = ("map", "time")
    equation: ClassVar = Equation(
        "sum(D[a, j] * f[j] for j in others(a))",
        (Symbol("D[a, j]", "g-sensitivity of output a along axis j", "deg/s/g", "g_{j}"),),
    )
    sources: ClassVar = (term_528("acceleration-sensitive drift rate"),)

    def felt_along(self, axis: str) -> tuple[str, ...]:
        return tuple(other for other in BODY_AXES if other != axis)

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        return [
            Column(f"g_{other}", "deg/s/g", force_g(channels, other))
            for other in BODY_AXES
            if other != axis and np.any(force_g(channels, other))
        ]


class GSquaredSensitivity(_Acceleration):
    """g-squared-sensitivity."""

    id = "g_squared_sensitivity"
    term = "Acceleration-squared-sensitive drift"
    sentence = "The bias changes with the square of gravity along an axis, alike for up and down."
    ranges: ClassVar = {"fog": (0.0, 1e-4), "mems": (1e-4, 1e-2), "piezo": (0.0, 1e-2)}
    experiment = "up and down positions within one run, or a centrifuge"
    draws = ("map", "time")
    equation: ClassVar = Equation(
        "D * f[a]**2",
        (Symbol("D", "sensitivity to the square of the specific force", "deg/s/g^2", "g_own_squared"),),
    )
    sources: ClassVar = (term_528("acceleration-squared-sensitive drift rate"),)

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        return [Column("g_own_squared", "deg/s/g^2", force_g(channels, axis) ** 2)]


class CentripetalAcceleration(_Acceleration):
    """Centripetal acceleration on a g-sensitive gyro."""

    id = "centripetal_acceleration"
    term = "Centripetal acceleration with g-sensitivity (eccentric mounting)"
    sentence = (
        "The unit is mounted off the table's axis, so the centripetal acceleration of the turning gives an error in "
        "the rate."
    )
    origin: ClassVar[Origin] = "fixture"
    shows_at_rest = False
    ranges: ClassVar = {"fog": (0.0, 1e-3), "mems": (0.0, 0.1), "piezo": (0.0, 0.2)}
    aliases = ("scale_factor_even",)
    alike_at_one_radius = True
    parameters = (
        Parameter(
            "by_position",
            "1",
            0,
            1,
            meaning="1: one coefficient for each position of the unit on the table; 0: one for all positions",
        ),
    )
    experiment = "the same rates at another radius, or with the unit turned by 180 deg on the table"
    draws = ("table_rate_dps", "map")
    usual_m: ClassVar[float] = 0.1  #: distance from the table's axis in the columns of rows that do not state it
    equation: ClassVar = Equation(
        "(D[p] if by_position else D) * r / g_n * (pi / 180 * omega_t)**2",
        (
            Symbol(
                "D[p]",
                "g-sensitivity in position p; where the distance is not known, times that distance over 0.1 m",
                "deg/s/g",
                "centripetal_{p}_up",
            ),
            Symbol("D", "the same, one for all positions", "deg/s/g", "centripetal"),
        ),
        where=(
            ("r", "0.1"),
            ("g_n", "9.80665"),
        ),
        others=(
            Symbol("p", "position of the unit: the axis that points up", ""),
            Symbol("r", "distance from the axis of the table as the position states it, such as zr200; else 0.1", "m"),
            Symbol("g_n", "standard acceleration of gravity", "m/s^2"),
        ),
    )
    sources: ClassVar = (
        Source(
            "BIPM, The International System of Units, and 3rd CGPM 1901, Resolution 2",
            "standard acceleration of gravity, 9.80665 m/s^2",
        ),
        term_528("acceleration-sensitive drift rate"),
    )

    def felt_along(self, axis: str) -> tuple[str, ...]:
        return ()  # it follows from the rate

    def undetermined_by(self, channels: Channels, axis: str) -> str:
        if not knows_pull(channels):
            return ""
        return (
            "the distance from the table's axis and the body axis that points away from it are known, so that the "
            "centripetal acceleration is part of the specific force; fit g_sensitivity or cross_g_sensitivity"
        )

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        """Return the centripetal acceleration; its direction in the body may differ between positions.

        Rows whose distance from the table's axis is not known have coefficients of their own beside rows where it is:
        their distance is neither 0 nor that of the others.
        """
        radius_m = channels.radius_m()
        is_known = np.isfinite(radius_m)
        pulls_g = pull_g(channels, np.where(is_known, radius_m, self.usual_m))
        columns = []
        for name, rows in self._places(channels, by_position=bool(term.parameters.get("by_position", 1.0))):
            kinds = [("", rows & is_known), ("_unknown_radius" if is_known.any() else "", rows & ~is_known)]
            columns += [
                Column(f"{name}{kind}", "deg/s/g", np.where(of_kind, pulls_g, 0.0))
                for kind, of_kind in kinds
                if of_kind.any() or not len(channels)
            ]
        return columns

    @staticmethod
    def _places(channels: Channels, *, by_position: bool) -> list[tuple[str, NDArray[np.bool_]]]:
        """Return what has a coefficient of its own, and its rows (n,): a position, at whatever distance, or all."""
        if not by_position:
            return [("centripetal", np.ones(len(channels), dtype=bool))]
        rows_of: dict[str, NDArray[np.bool_]] = {}
        for text, rows in channels.positions():
            name = f"centripetal_{Position.of(text).without_radius}_up"
            rows_of[name] = rows_of.get(name, np.zeros(len(channels), dtype=bool)) | rows
        return list(rows_of.items())

    def options(self, span: Span) -> list[Term]:
        return by_parameter(self.id, by_position=np.array([0.0, 1.0]))


EFFECTS: tuple[type[Effect], ...] = (
    GSensitivity,
    CrossGSensitivity,
    GSquaredSensitivity,
    CentripetalAcceleration,
)
