"""What gravity and turning off the axis do: specific force is felt as rate."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.effects.base import Column, Effect, Parameter, Reference, Rows, Span, Term, by_parameter
from labctl.fitting.effects.equation import Equation, Source, Symbol, term_528
from labctl.fitting.numeric.arrays import Array

if TYPE_CHECKING:
    from labctl.answers.effect_origin import Origin

GRAVITY = 9.80665
#: Specific force along an axis that changes by less, g, is the tilt of a support and the drift of an accelerometer with
#: temperature, tens of mg for a low-cost one (its data sheet), and no change of pose.
MIN_CHANGE_G = 0.1
#: Between these quantiles of a logged force the change counts, so that a knock does not.
QUANTILES = (0.01, 0.99)


class _Acceleration(Effect):
    origin: ClassVar[Origin] = "sensor"
    in_use = False  # gravity is known from the position on the bench; in use `force_sensitivity` needs an accelerometer
    rows: ClassVar[Rows] = "all"
    shows_at_rest = True

    def undetermined_by(self, channels: Channels, axis: str) -> str:
        changes = {body: change_g(channels, body) for body in self.felt_along(axis)}
        if not changes or max(changes.values()) >= MIN_CHANGE_G:
            return ""
        changes_text = ", ".join(f"{body} by {change:.2g} g" for body, change in changes.items())
        return (
            f"no change of pose: the specific force changes less than {MIN_CHANGE_G} g ({changes_text}), as a "
            "support tilts "
            "or an accelerometer drifts; measure each axis up and down"
        )

    def felt_along(self, axis: str) -> tuple[str, ...]:
        """Return the body axes whose force this effect takes for an output axis."""
        return (axis,)


def force_g(channels: Channels, axis: str) -> Array:
    """Return the specific force along a body axis, (n,) g: logged, or what gravity gives in each position."""
    name = f"accel_{axis}_g"
    return np.asarray(channels[name], dtype=np.float64) if name in channels else channels.up(axis)


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
    equation: ClassVar = Equation(
        "(D[p] if by_position else D) * r / g_n * (pi / 180 * omega_t)**2",
        (
            Symbol(
                "D[p]",
                "g-sensitivity in position p, if the unit is 0.1 m off the axis; else times 0.1 m over the distance",
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
            Symbol("r", "distance from the axis of the table", "m"),
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

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        """Return the centripetal acceleration at 0.1 m; its direction in the body may differ between positions."""
        pull_g = np.deg2rad(channels.table_rate_dps()) ** 2 * 0.1 / GRAVITY
        if not term.parameters.get("by_position", 1.0):
            return [Column("centripetal", "deg/s/g", pull_g)]
        return [
            Column(f"centripetal_{up_position}_up", "deg/s/g", np.where(rows, pull_g, 0.0))
            for up_position, rows in channels.positions()
        ]

    def options(self, span: Span) -> list[Term]:
        return by_parameter(self.id, by_position=np.array([0.0, 1.0]))


EFFECTS: tuple[type[Effect], ...] = (
    GSensitivity,
    CrossGSensitivity,
    GSquaredSensitivity,
    CentripetalAcceleration,
)
