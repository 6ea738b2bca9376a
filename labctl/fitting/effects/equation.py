"""The equation of an effect, what its symbols mean, and where it is from: data that each effect declares.

An equation is written once, as a Python expression: `omega[a] * sum(s[k] * (T - T_ref)**k for k in upto(1, n))`. Pages
and documentation show it as MathML (`mathml`), and a test evaluates it beside the effect's own columns.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from labctl.answers.effects import Gives


@dataclass(frozen=True)
class Symbol:
    """A symbol of an equation."""

    symbol: str  #: as it stands in the equation: `b[k]`
    meaning: str
    unit: str  #: "1": of no dimension; "": an index
    name: str = ""  #: of the column, the coefficient (`bias_t{k}`) or the parameter that it stands for


@dataclass(frozen=True)
class Source:
    """A publication, and the place in it."""

    work: str
    place: str
    gives: Gives = "equation"


@dataclass(frozen=True)
class Equation:
    """The error of the output of axis a, deg/s, output minus rate, and the lines that define what stands in it.

    A line is the left side and the right side: `("d(T_g)/d(t)", "(T - T_g) / tau")`.
    """

    error: str
    coefficients: tuple[Symbol, ...]  #: what a fit estimates
    where: tuple[tuple[str, str], ...] = ()
    others: tuple[Symbol, ...] = ()  #: beside channels (`CHANNELS`) and parameters


#: Symbols that mean the same in every equation.
CHANNELS: Mapping[str, Symbol] = {
    each.symbol: each
    for each in (
        Symbol("a", "output axis: x, y or z", ""),
        Symbol("j", "another axis of the body", ""),
        Symbol("k", "power", ""),
        Symbol("n", "order of the polynomial", ""),
        Symbol("e", "error of the output: output minus rate about the axis", "deg/s"),
        Symbol("omega", "rate about an axis of the body", "deg/s"),
        Symbol("omega_t", "rate of the table", "deg/s", "table_rate_dps"),
        Symbol("omega_b", "rate of the table in the data set before", "deg/s", "previous_rate_dps"),
        Symbol("omega_max", "largest rate of the table in the recording, without sign", "deg/s"),
        Symbol("T", "thermometer of the unit", "deg C", "temperature_c"),
        Symbol("T_ref", "reference temperature of the calibration", "deg C"),
        Symbol("T_c", "air of the chamber", "deg C", "chamber_c"),
        Symbol("t", "time since the start of the recording", "s", "t_s"),
        Symbol("t_on", "time since power-on", "s", "power_s"),
        Symbol("theta", "angle of the table", "deg", "table_angle_deg"),
        Symbol("u", "share of an axis of the body that points up along the table axis: 1, 0 or -1", "1", "position"),
        Symbol(
            "f",
            "specific force along an axis of the body: logged, or gravity in that position, and where position says "
            "how far from the table's axis the unit is, the centripetal acceleration",
            "g",
            "accel_{a}_g",
        ),
        Symbol("V", "supply voltage", "V", "supply_v"),
        Symbol("pi", "3.14159...", "1"),
    )
}

IEEE_528 = "IEEE Std 528, Standard for Inertial Sensor Terminology"
IEEE_952 = "IEEE Std 952-1997, Single-Axis Interferometric Fiber Optic Gyros"
OJEDA = (
    "L. Ojeda, H. Chung, J. Borenstein, Precision-calibration of fiber-optics gyroscopes for mobile robot navigation, "
    "Proc. IEEE ICRA 2000, pp. 2064-2069"
)
YANG = (
    "H. Yang, B. Zhou, L. Wang, H. Xing, R. Zhang, A novel tri-axial MEMS gyroscope calibration method over a full "
    "temperature range, Sensors 18(9), 2018, 3004"
)
WEISS = "Weiss, Usage of a vibrating gyroscope for orientation estimation, University of Kaiserslautern"


def term_528(term: str) -> Source:
    """Return the definition of a term in IEEE Std 528."""
    return Source(IEEE_528, f"term {term!r}", "definition")
