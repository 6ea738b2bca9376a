"""What is the bench's or the Earth's and not the gyro's: the table's rate and level, north, the hall's field."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from labctl.fitting.data.channels import Channels
from labctl.fitting.effects.base import Column, Effect, Parameter, Reference, Rows, Span, Term, by_parameter
from labctl.fitting.effects.equation import IEEE_952, OJEDA, Equation, Source, Symbol, term_528

if TYPE_CHECKING:
    from labctl.answers.effect_origin import Origin


class EarthRate(Effect):
    """Earth rate along the table axis."""

    id = "earth_rate"
    term = "Earth rate"
    sentence = "The bench turns with the Earth; along the table axis that is a constant rate."
    origin: ClassVar[Origin] = "environment"
    rows: ClassVar[Rows] = "own"
    shows_at_rest = True
    ranges: ClassVar = {"fog": (0.0, 0.0042), "mems": (0.0, 0.0042), "piezo": (0.0, 0.0042)}
    experiment = "axis up and axis down; give the bench's latitude, from which the Earth's rate is computed"
    draws = ("map",)
    equation: ClassVar = Equation(
        "Omega * u[a]",
        (
            Symbol(
                "Omega",
                "vertical part of the Earth's rate: 0.004178 deg/s times the sine of the latitude",
                "deg/s",
                "earth_up",
            ),
        ),
    )
    sources: ClassVar = (
        Source("NIMA TR8350.2, World Geodetic System 1984, 3rd ed.", "rate of the Earth, 7292115e-11 rad/s"),
    )

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        return [Column("earth_up", "deg/s", channels.up(axis))]


class _OncePerTurn(Effect):
    needs = ("table_angle_deg",)
    rows: ClassVar[Rows] = "all"
    shows_at_rest = True
    mark: ClassVar[str]

    def harmonics(self, term: Term) -> tuple[int, ...]:
        """Return the cycles per turn of the waves."""
        return (1,)

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        ones = np.ones(len(channels))
        return [
            Column(f"{self.mark}_{wave}{n}", "deg/s", ones, (wave, n))
            for n in self.harmonics(term)
            for wave in ("cos", "sin")
        ]


class EarthRateTilt(_OncePerTurn):
    """Horizontal Earth rate on an axis that is not quite upright."""

    id = "earth_rate_tilt"
    term = "Earth rate on a tilted or horizontal axis"
    sentence = "The horizontal part of the Earth's rate gives an error of one cycle per turn; its phase points north."
    origin: ClassVar[Origin] = "environment"
    ranges: ClassVar = {"fog": (0.0, 0.0042), "mems": (0.0, 0.0042), "piezo": (0.0, 0.0042)}
    aliases = ("magnetic_sensitivity", "table_tilt")
    mark = "earth"
    experiment = "turn the table's base by 90 deg: the phase of an error due to the Earth's rate stays fixed to north"
    draws = ("angle",)
    equation: ClassVar = Equation(
        "c * cos(theta) + s * sin(theta)",
        (
            Symbol(
                "c",
                "amplitude of the cosine; a data set sees its mean over the angles that it covers",
                "deg/s",
                "earth_cos1",
            ),
            Symbol("s", "amplitude of the sine; the phase points north", "deg/s", "earth_sin1"),
        ),
    )
    sources: ClassVar = (
        Source(
            "NIMA TR8350.2, World Geodetic System 1984, 3rd ed.",
            "rate of the Earth, 7292115e-11 rad/s; horizontal part: times the cosine of the latitude",
        ),
    )


class MagneticSensitivity(_OncePerTurn):
    """Magnetic sensitivity."""

    id = "magnetic_sensitivity"
    term = "Magnetic sensitivity"
    sentence = "The local magnetic field makes the bias vary with the table angle, one cycle per turn."
    origin: ClassVar[Origin] = "environment"
    ranges: ClassVar = {"fog": (0.0, 0.005), "mems": (0.0, 0.005), "piezo": (0.0, 0.05)}
    aliases = ("earth_rate_tilt", "table_tilt")
    mark = "field"
    experiment = "a coil around the fixture, a shield, or a magnetometer logged"
    draws = ("angle",)
    equation: ClassVar = Equation(
        "c * cos(theta) + s * sin(theta)",
        (
            Symbol(
                "c",
                "amplitude of the cosine; a data set sees its mean over the angles that it covers",
                "deg/s",
                "field_cos1",
            ),
            Symbol("s", "amplitude of the sine", "deg/s", "field_sin1"),
        ),
    )
    sources: ClassVar = (Source(IEEE_952, "sensitivity to magnetic fields", "definition"),)


class TableTilt(_OncePerTurn):
    """Tilt and wobble of the table."""

    id = "table_tilt"
    term = "Table tilt and wobble with g-sensitivity"
    sentence = (
        "The table is out of level or its bearing wobbles, so gravity along the axes varies once and twice per turn."
    )
    origin: ClassVar[Origin] = "bench"
    parameters = (
        Parameter(
            "wobbles",
            "1",
            0,
            1,
            meaning="1: the bearing wobbles, two cycles per turn besides one; 0: the table is out of level only",
        ),
    )
    aliases = ("earth_rate_tilt", "magnetic_sensitivity")
    ranges: ClassVar = {"fog": (0.0, 0.005), "mems": (0.0, 0.01), "piezo": (0.0, 0.05)}
    mark = "tilt"
    experiment = "level the table; then repeat with a deliberate tilt of 2 deg"
    draws = ("angle",)
    equation: ClassVar = Equation(
        "sum(c[k] * cos(k * theta) + s[k] * sin(k * theta) for k in upto(1, 2 if wobbles else 1))",
        (
            Symbol(
                "c[k]",
                "amplitude of the cosine of k cycles per turn; a data set sees its mean over the angles that it covers",
                "deg/s",
                "tilt_cos{k}",
            ),
            Symbol("s[k]", "amplitude of the sine of k cycles per turn", "deg/s", "tilt_sin{k}"),
        ),
        others=(Symbol("k", "cycles per turn", ""),),
    )
    sources: ClassVar = (term_528("acceleration-sensitive drift rate"),)

    def harmonics(self, term: Term) -> tuple[int, ...]:
        """Return one cycle per turn of a table that is out of level, and two with a bearing that wobbles."""
        return (1, 2) if term.parameters.get("wobbles", 1.0) else (1,)

    def options(self, span: Span) -> list[Term]:
        return by_parameter(self.id, wobbles=np.array([0.0, 1.0]))


class TableRateRatio(Effect):
    """Ratio and clock of the table."""

    id = "table_rate_ratio"
    term = "Table rate error (gear ratio, step clock)"
    sentence = "The table turns faster or slower than its steps say; the gyro cannot tell this from its scale factor."
    origin: ClassVar[Origin] = "bench"
    ranges: ClassVar = {"fog": (0.0, 2e-4), "mems": (0.0, 2e-4), "piezo": (0.0, 2e-4)}
    aliases = ("scale_factor",)
    experiment = "count whole turns against an index pulse"
    draws = ("table_rate_dps", "map")
    equation: ClassVar = Equation(
        "s * omega[a]",
        (Symbol("s", "error of the ratio between steps and rate", "1", "table_rate"),),
    )
    sources: ClassVar = (Source(OJEDA, "description of the bench: a stepper motor with a gear of 4:1", "definition"),)

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        return [Column("table_rate", "1", channels.rate_dps(axis))]


class TableRateRipple(Effect):
    """Periodic rate error of the table."""

    id = "table_rate_ripple"
    term = "Table rate error, periodic (gear eccentricity, microsteps)"
    sentence = "The table speeds up and slows down within a turn, in proportion to its rate."
    origin: ClassVar[Origin] = "bench"
    needs = ("table_angle_deg",)
    parameters = (Parameter("per_turn", "1", 1, 200, symbol="N", meaning="cycles of the ripple per turn of the table"),)
    ranges: ClassVar = {"fog": (0.0, 0.01), "mems": (0.0, 0.01), "piezo": (0.0, 0.01)}
    experiment = (
        "data sets over whole turns that start and stop at the same angle; check whether the wave repeats with the "
        "angle or with time"
    )
    draws = ("angle", "frequency")
    equation: ClassVar = Equation(
        "omega[a] * (c * cos(N * theta) + s * sin(N * theta))",
        (
            Symbol(
                "c",
                "amplitude of the cosine, a share of the rate; a data set sees its mean over the angles that it covers",
                "1",
                "ripple_cos{N}",
            ),
            Symbol("s", "amplitude of the sine, as a share of the rate", "1", "ripple_sin{N}"),
        ),
    )
    sources: ClassVar = (Source(OJEDA, "description of the bench: a stepper motor with a gear of 4:1", "definition"),)

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        n, rate = int(term.parameters.get("per_turn", 4)), channels.rate_dps(axis)
        return [Column(f"ripple_{wave}{n}", "1", rate, (wave, n)) for wave in ("cos", "sin")]

    def options(self, span: Span) -> list[Term]:
        return by_parameter(self.id, per_turn=np.array([1.0, 4.0]))


class MissedSteps(Effect):
    """Missed steps."""

    id = "missed_steps"
    term = "Missed steps (stall)"
    sentence = "Above a certain rate the motor loses steps, so the table turns more slowly than commanded."
    origin: ClassVar[Origin] = "bench"
    parameters = (
        Parameter(
            "stall_dps",
            "deg/s",
            20.0,
            400.0,
            symbol="omega_s",
            meaning="rate above which steps are lost; the transition takes 1 % of it",
        ),
    )
    ranges: ClassVar = {"fog": (-1.0, 0.0), "mems": (-1.0, 0.0), "piezo": (-1.0, 0.0)}
    one_sign = True
    experiment = "count index pulses"
    draws = ("table_rate_dps", "worst")
    equation: ClassVar = Equation(
        "s * omega[a] * (1 + tanh((abs(omega[a]) - omega_s) / (0.01 * omega_s))) / 2",
        (Symbol("s", "share of the steps that are lost, negative", "1", "missed_steps"),),
    )
    sources: ClassVar = (Source(OJEDA, "description of the bench: a stepper motor", "definition"),)

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        rate, stall = channels.rate_dps(axis), term.parameters.get("stall_dps", 100.0)
        lost = 0.5 * (1.0 + np.tanh((np.abs(rate) - stall) / (0.01 * stall)))
        return [Column("missed_steps", "1", rate * lost)]

    def options(self, span: Span) -> list[Term]:
        rates = np.array([rate for rate in span.rates_dps if 0.5 * span.rate_dps <= rate <= span.rate_dps])
        return by_parameter(self.id, stall_dps=np.sort(np.concatenate([rates, span.between_rates(0.5, 1.0)])))


EFFECTS: tuple[type[Effect], ...] = (
    EarthRate,
    EarthRateTilt,
    MagneticSensitivity,
    TableTilt,
    TableRateRatio,
    TableRateRipple,
    MissedSteps,
)
