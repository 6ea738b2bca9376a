"""What bends, steps or resonates with the rate, beside the powers of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.effects.base import Column, Effect, Parameter, Reference, Rows, Span, Term, by_parameter
from labctl.fitting.effects.equation import IEEE_952, Equation, Source, Symbol, term_528

if TYPE_CHECKING:
    from labctl.answers.effect_origin import Origin


class CrossAxisNonlinearity(Effect):
    """Cross-axis nonlinearity."""

    id = "cross_axis_nonlinearity"
    term = "Cross-axis nonlinearity"
    sentence = "Turning about another axis gives an error that grows like the square of that rate."
    origin: ClassVar[Origin] = "sensor"
    rows: ClassVar[Rows] = "cross"
    ranges: ClassVar = {"fog": (0.0, 1e-7), "mems": (0.0, 1e-6), "piezo": (0.0, 1e-5)}
    experiment = "a second table axis, so that two rates can be given at once"
    draws = ("table_rate_dps", "map")
    equation: ClassVar = Equation(
        "sum(q[a, j] * omega[j]**2 for j in others(a))",
        (
            Symbol(
                "q[a, j]", "error of output a per square of the rate about axis j", "(deg/s)^-1", "cross_{j}_squared"
            ),
        ),
    )
    sources: ClassVar = (term_528("cross-axis sensitivity"),)

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        return [
            Column(f"cross_{other}_squared", "(deg/s)^-1", channels.rates[other] ** 2)
            for other in BODY_AXES
            if other != axis and other in channels.rates
        ]


class VibrationRectification(Effect):
    """Vibration rectification at a resonance of the table."""

    id = "vibration_rectification"
    in_use = False
    term = "Vibration rectification"
    sentence = "Near one table rate the motor steps excite a mechanical resonance, and the vibration appears as a rate."
    origin: ClassVar[Origin] = "sensor"
    rows: ClassVar[Rows] = "all"
    parameters = (
        Parameter(
            "centre_dps",
            "deg/s",
            1.0,
            400.0,
            logarithmic=True,
            symbol="omega_0",
            meaning="rate of the table at which the resonance is excited",
        ),
        Parameter(
            "width",
            "1",
            0.15,
            0.8,
            logarithmic=True,
            symbol="B",
            meaning="width of the resonance: logarithm of the ratio of rates at which 1/e of the error is left",
        ),
    )
    ranges: ClassVar = {"fog": (0.0, 0.005), "mems": (0.0, 0.05), "piezo": (0.0, 0.5)}
    experiment = "the same rates at another microstep setting or motor current, with an accelerometer logged"
    draws = ("table_rate_dps", "map")
    equation: ClassVar = Equation(
        "v * exp(-(ln(abs(omega_t) / omega_0) / B)**2)",
        (Symbol("v", "error at the resonance", "deg/s", "vibration"),),
    )
    sources: ClassVar = (term_528("vibration rectification error"),)

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        centre, width = term.parameters.get("centre_dps", 100.0), term.parameters.get("width", 0.4)
        speed = np.maximum(np.abs(channels.table_rate_dps()), 1e-3)
        return [Column("vibration", "deg/s", np.exp(-((np.log(speed / centre) / width) ** 2)))]

    def options(self, span: Span) -> list[Term]:
        centres = np.geomspace(max(0.04 * span.rate_dps, span.slowest_dps), 0.9 * span.rate_dps, 9)
        return by_parameter(self.id, centre_dps=centres, width=np.array([0.2, 0.4, 0.7]))


class DeadBand(Effect):
    """Dead band, lock-in, threshold."""

    id = "dead_band"
    term = "Dead band (threshold, lock-in)"
    sentence = "Below a small threshold rate the output is zero, and a little above the threshold it is too small."
    origin: ClassVar[Origin] = "sensor"
    parameters = (
        Parameter(
            "band_dps",
            "deg/s",
            0.005,
            150.0,
            logarithmic=True,
            symbol="omega_L",
            meaning="threshold: the output is 0 for smaller rates",
        ),
    )
    ranges: ClassVar = {"fog": (0.0, 1.0), "mems": (0.0, 1.0), "piezo": (0.0, 1.0)}
    one_sign = True
    experiment = "rates from 0.01 to 1 deg/s of both signs, evenly spaced on a logarithmic scale"
    draws = ("table_rate_dps", "map")
    equation: ClassVar = Equation(
        "d * (sign(omega[a]) * sqrt(max(omega[a]**2 - omega_L**2, 0)) - omega[a])",
        (Symbol("d", "size; 1: the output is 0 within the band", "1", "dead_band"),),
    )
    sources: ClassVar = (
        Source(
            "W. W. Chow and others, The ring laser gyro, Rev. Mod. Phys. 57, 1985, pp. 61-104",
            "lock-in: the beat frequency is the root of the difference of the squares of rate and lock-in rate",
        ),
        term_528("dead band"),
    )

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        rate, band = channels.rate_dps(axis), term.parameters.get("band_dps", 0.05)
        passed = np.sign(rate) * np.sqrt(np.maximum(rate * rate - band * band, 0.0))
        return [Column("dead_band", "1", passed - rate)]

    def options(self, span: Span) -> list[Term]:
        return by_parameter(self.id, band_dps=np.geomspace(0.005, 0.35 * span.rate_dps, 10))


class Quantization(Effect):
    """Quantization of the output."""

    id = "quantization"
    term = "Quantization"
    sentence = "The output changes in coarse steps, so the error is a sawtooth function of the output."
    origin: ClassVar[Origin] = "sensor"
    parameters = (
        Parameter("step_dps", "deg/s", 0.003, 1.0, logarithmic=True, symbol="Delta", meaning="step of the output"),
    )
    ranges: ClassVar = {"fog": (0.0, 1.0), "mems": (0.0, 1.0), "piezo": (0.0, 1.0)}
    one_sign = True
    needs = ("raw_code",)
    experiment = "a histogram of raw codes at rest"
    draws = ("table_rate_dps", "repeats")
    equation: ClassVar = Equation(
        "q * (Delta * floor(omega[a] / Delta + 1 / 2) - omega[a])",
        (Symbol("q", "size; 1: the output is rounded to whole steps", "1", "quantization"),),
    )
    sources: ClassVar = (Source(IEEE_952, "Annex C.1.5, quantization noise", "definition"),)

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        step, rate = term.parameters.get("step_dps", 0.05), channels.rate_dps(axis)
        return [Column("quantization", "1", step * np.floor(rate / step + 0.5) - rate)]

    def options(self, span: Span) -> list[Term]:
        return by_parameter(self.id, step_dps=np.geomspace(0.003, 1.0, 6))


EFFECTS: tuple[type[Effect], ...] = (CrossAxisNonlinearity, VibrationRectification, DeadBand, Quantization)
