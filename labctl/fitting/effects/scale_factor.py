"""Scale factor: how the output follows the rate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from labctl.fitting.data.channels import Channels
from labctl.fitting.effects.base import Column, Effect, Law, Parameter, Reference, Span, Term, by_parameter, powers
from labctl.fitting.effects.equation import IEEE_952, OJEDA, YANG, Equation, Source, Symbol, term_528
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.open_loop_sine import sine_ratio, sine_ratio_slope

if TYPE_CHECKING:
    from labctl.answers.effect_origin import Origin

#: Parameter of a sine response whose amplitude was fitted beside K, in calibrations up to version 0.1.
FREE_AMPLITUDE = "free_amplitude"
#: Below this K^2 the law is replaced by its tangent.
MIN_K_SQUARED = 1e-6


#: Order in temperature of the surface of Ojeda, Chung and Borenstein (ICRA 2000, eqs. 10 to 12).
TEMPERATURE_ORDER = 2


class ScaleFactor(Effect):
    """Scale factor error."""

    id = "scale_factor"
    term = "Scale factor error"
    sentence = "The output is larger or smaller than the rate by a constant factor."
    origin: ClassVar[Origin] = "sensor"
    ranges: ClassVar = {"fog": (0.0, 0.005), "mems": (0.0, 0.01), "piezo": (0.0, 0.0035)}
    aliases = ("table_rate_ratio",)
    experiment = "count whole turns against an index pulse: the integral of the output is 360 deg each"
    draws = ("table_rate_dps", "map")
    equation: ClassVar = Equation(
        "s * omega[a]",
        (Symbol("s", "scale factor error", "1", "scale_factor"),),
    )
    sources: ClassVar = (
        Source(YANG, "error model, output = K rate + B: diagonal of K"),
        term_528("scale factor"),
    )

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        return [Column("scale_factor", "1", channels.rate_dps(axis))]


class ScaleFactorTemperature(Effect):
    """Scale factor temperature sensitivity."""

    id = "scale_factor_temperature"
    term = "Scale factor temperature sensitivity"
    sentence = "The scale factor changes with the gyro's temperature."
    by_temperature = True
    origin: ClassVar[Origin] = "sensor"
    default_order = 2
    max_order = 5
    ranges: ClassVar = {"fog": (0.0, 1e-3), "mems": (1e-4, 5e-4), "piezo": (0.0, 2e-4)}
    experiment = "the same rates on the way up and on the way down in temperature"
    draws = ("map",)
    equation: ClassVar = Equation(
        "omega[a] * sum(s[k] * (T - T_ref)**k for k in upto(1, n))",
        (Symbol("s[k]", "temperature coefficient of the scale factor of power k", "1/K^k", "scale_factor_t{k}"),),
    )
    sources: ClassVar = (
        Source(OJEDA, "Eqs. 9 to 11, terms of rate to the power 1"),
        Source(IEEE_952, "model equation, scale factor error over temperature", "definition"),
    )

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        rate = channels.rate_dps(axis)
        centred = channels.temperature_c(axis) - reference.temperature_c
        return [
            Column(f"scale_factor_t{k}", f"1/K^{k}" if k > 1 else "1/K", rate * column)
            for k, column in powers(centred, range(1, self.order(term) + 1)).items()
        ]

    def options(self, span: Span) -> list[Term]:
        return [Term(self.id, order) for order in (1, 2, 3)]  # a higher order would follow any curve

    def least(self, term: Term) -> tuple[int, int]:
        return 2, self.order(term) + 1


class ScaleFactorAsymmetry(Effect):
    """Scale factor asymmetry."""

    id = "scale_factor_asymmetry"
    term = "Scale factor asymmetry"
    sentence = "The scale factor differs between the two directions of turning."
    origin: ClassVar[Origin] = "sensor"
    ranges: ClassVar = {"fog": (1e-5, 5e-4), "mems": (5e-5, 1e-3), "piezo": (0.0, 1e-3)}
    experiment = "at least six rates of each sign, in random order"
    draws = ("table_rate_dps", "map")
    equation: ClassVar = Equation(
        "s * abs(omega[a])",
        (Symbol("s", "half the difference between the scale factors of the two directions", "1", "asymmetry"),),
    )
    sources: ClassVar = (
        term_528("asymmetry error"),
        Source(IEEE_952, "model equation, asymmetry of the scale factor", "definition"),
    )

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        return [Column("asymmetry", "1", np.abs(channels.rate_dps(axis)))]


class _Power(Effect):
    """Even or odd powers of the rate about the axis itself."""

    first: ClassVar[int]
    origin: ClassVar[Origin] = "sensor"

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        by_power = powers(channels.rate_dps(axis), range(self.first, self.order(term) + 1))
        return [
            Column(f"scale_factor_r{k}", f"(deg/s)^-{k - 1}", column)
            for k, column in by_power.items()
            if k % 2 == self.first % 2
        ]

    def least(self, term: Term) -> tuple[int, int]:
        return self.order(term) + 1, 1


class ScaleFactorEven(_Power):
    """Scale factor nonlinearity of even order."""

    id = "scale_factor_even"
    term = "Scale factor nonlinearity, even order"
    sentence = "The error grows like the square of the rate, with the same sign for both directions of turning."
    first = 2
    min_order = 2
    default_order = 2
    max_order = 4
    ranges: ClassVar = {"fog": (0.0, 1e-6), "mems": (1e-7, 2e-6), "piezo": (0.0, 1e-5)}
    aliases = ("centripetal_acceleration",)
    alike_at_one_radius = True
    experiment = "repeat at another radius, or with the unit turned by 180 deg on the table"
    draws = ("table_rate_dps", "map")
    equation: ClassVar = Equation(
        "sum(s[k] * omega[a]**k for k in even(2, n))",
        (Symbol("s[k]", "nonlinearity of power k", "(deg/s)^-(k-1)", "scale_factor_r{k}"),),
    )
    sources: ClassVar = (
        Source(OJEDA, "Eq. 3 (a cubic in the rate), term of power 2"),
        Source(IEEE_952, "model equation, nonlinearity of the scale factor", "definition"),
    )


class ScaleFactorOdd(_Power):
    """Scale factor nonlinearity of odd order."""

    id = "scale_factor_odd"
    bends_at_high_rates = True
    term = "Scale factor nonlinearity, odd order"
    sentence = "The error bends away from a line at high rates, with opposite signs for the two directions."
    first = 3
    min_order = 3
    default_order = 3
    max_order = 5
    ranges: ClassVar = {"fog": (0.0, 5e-7), "mems": (0.0, 1e-8), "piezo": (0.0, 1e-7)}
    experiment = "more rates in the top third of the range"
    draws = ("table_rate_dps", "map")
    equation: ClassVar = Equation(
        "sum(s[k] * omega[a]**k for k in odd(3, n))",
        (Symbol("s[k]", "nonlinearity of power k", "(deg/s)^-(k-1)", "scale_factor_r{k}"),),
    )
    sources: ClassVar = (
        Source(OJEDA, "Eq. 3 (a cubic in the rate), term of power 3"),
        Source(IEEE_952, "model equation, nonlinearity of the scale factor", "definition"),
    )


class SineResponse(Effect):
    """Sine response of an open-loop interferometer: error = sin(K w) / K - w, with one constant K per axis.

    The coefficient that a fit estimates is the square of K, in which the law is smooth through 0 and its uncertainty
    close to normal; K follows from it. The shape's parameter is where the law is linearised for the effects that
    compete linearly.
    """

    id = "sine_response"
    bends_at_high_rates = True
    term = "Sine response (open-loop interferometer)"
    sentence = "The output is proportional to the sine of the optical phase, so it is too small at high rates."
    origin: ClassVar[Origin] = "sensor"
    parameters = (
        Parameter(
            "k",
            "rad/(rad/s)",
            0.05,
            1.0,
            logarithmic=True,
            symbol="K",
            refined=True,
            meaning="optical phase per rate, at which the law is linearised while effects compete",
        ),
    )
    ranges: ClassVar = {"fog": (0.0, 2.25), "mems": (0.0, 0.0), "piezo": (0.0, 0.0)}
    one_sign = True
    experiment = "more rates in the top third of the range"
    draws = ("table_rate_dps", "map")
    equation: ClassVar = Equation(
        "180 / pi * (sin(K * omega_r) / K - omega_r)",
        (Symbol("K", "optical phase per rate; a fit estimates its square, k_squared", "rad/(rad/s)", "k"),),
        where=(("omega_r", "pi / 180 * omega[a]"),),
        others=(Symbol("omega_r", "rate about the axis in radians", "rad/s"),),
    )
    sources: ClassVar = (
        Source(
            "H. C. Lefèvre, The Fiber-Optic Gyroscope, 2nd ed., 2014",
            "interferometer with biasing modulation: a signal proportional to the sine of the Sagnac phase",
        ),
    )

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        rate = np.deg2rad(channels.rate_dps(axis))
        if FREE_AMPLITUDE in term.parameters:
            k = term.parameters["k"]
            return [Column("sine_response", "1", np.rad2deg(np.sin(k * rate) / k - rate))]
        at = term.parameters.get(f"k_squared_{axis}", term.parameters.get("k", 0.0) ** 2)
        cube = np.rad2deg(rate**3)

        def error_dps(k_squared: Array) -> Array:
            return np.rad2deg(rate) * (sine_ratio(k_squared * rate**2) - 1.0)

        def slope(k_squared: Array) -> Array:
            return cube * sine_ratio_slope(k_squared * rate**2)

        amplitudes = np.full(len(rate), at)
        shape = error_dps(amplitudes) / at if abs(at) > MIN_K_SQUARED else slope(amplitudes)
        return [Column("k_squared", "(rad/(rad/s))^2", shape, law=Law(error_dps, slope), start=at)]

    def shaped_by(self, term: Term, coefficients: Mapping[str, float]) -> Term:
        shapes = {f"k_squared_{axis}": value for axis, value in coefficients.items()}
        return replace(term, parameters={**term.parameters, **shapes})


class Saturation(Effect):
    """Saturation near the input rate limit."""

    id = "saturation"
    bends_at_high_rates = True
    term = "Saturation (input rate limit)"
    sentence = "Above a certain rate the output increases less than the rate, in the extreme no longer."
    origin: ClassVar[Origin] = "sensor"
    parameters = (
        Parameter(
            "knee_dps", "deg/s", 20.0, 400.0, symbol="omega_k", meaning="rate above which the output lags behind"
        ),
    )
    ranges: ClassVar = {"fog": (-1.0, 0.0), "mems": (-1.0, 0.0), "piezo": (-1.0, 0.0)}
    one_sign = True
    experiment = "rates every 2 to 5 % above 70 % of full scale"
    draws = ("table_rate_dps", "map", "worst")
    equation: ClassVar = Equation(
        "s * sign(omega[a]) * D * ln(1 + exp((abs(omega[a]) - omega_k) / D))",
        (
            Symbol(
                "s",
                "share of the rate above the knee that is lost, negative; -1: the output no longer increases",
                "1",
                "saturation",
            ),
        ),
        where=(("D", "0.02 * omega_k"),),
        others=(Symbol("D", "width of the knee", "deg/s"),),
    )
    sources: ClassVar = (term_528("input limits"),)
    softness: ClassVar[float] = 0.02  #: width of the knee, as a share: saturation sets in gradually

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        rate = channels.rate_dps(axis)
        knee = term.parameters.get("knee_dps", 0.8 * float(np.max(np.abs(rate), initial=1.0)))
        excess = (np.abs(rate) - knee) / max(self.softness * knee, 1e-9)
        return [Column("saturation", "1", np.sign(rate) * self.softness * knee * np.logaddexp(0.0, excess))]

    def options(self, span: Span) -> list[Term]:
        return by_parameter(self.id, knee_dps=np.arange(0.5, 0.99, 0.05) * span.rate_dps)


def surface_unit(rate_power: int, temperature_power: int) -> str:
    """Return the unit of the coefficient of rate^i x temperature^j."""
    rate = {0: "deg/s", 1: "1"}.get(rate_power, f"(deg/s)^-{rate_power - 1}")
    return rate if temperature_power == 0 else f"{rate} K^-{temperature_power}"


class RateTemperatureSurface(Effect):
    """Error as a polynomial in rate and temperature; the order is the rate's, the temperature's is 2."""

    id = "rate_temperature_surface"
    term = "Bias and scale factor surface over rate and temperature"
    sentence = "The error is a smooth surface over rate and temperature: a cubic along one, a parabola along the other."
    by_temperature = True
    origin: ClassVar[Origin] = "sensor"
    default_order = 3
    max_order = 5
    experiment = (
        "nothing to separate: this surface includes bias, scale factor and nonlinearity with their temperature terms"
    )
    draws = ("map", "table_rate_dps", "temperature_c")
    equation: ClassVar = Equation(
        "sum(sum(c[i, k] * omega[a]**i * (T - T_ref)**k for k in upto(0, 2)) for i in upto(0, n))",
        (
            Symbol(
                "c[i, k]",
                "coefficient of rate to the power i and temperature to the power k",
                "(deg/s)^(1-i) K^-k",
                "c_r{i}_t{k}",
            ),
        ),
        others=(Symbol("i", "power of the rate", ""),),
    )
    sources: ClassVar = (Source(OJEDA, "Eqs. 9 to 12"),)

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        rate, centred = channels.rate_dps(axis), channels.temperature_c(axis) - reference.temperature_c
        ones = np.ones(len(channels))
        of_rate = {0: ones, **powers(rate, range(1, self.order(term) + 1))}
        of_temperature = {0: ones, **powers(centred, range(1, TEMPERATURE_ORDER + 1))}
        return [
            Column(f"c_r{i}_t{j}", surface_unit(i, j), of_rate[i] * of_temperature[j])
            for i in of_rate
            for j in of_temperature
        ]

    def least(self, term: Term) -> tuple[int, int]:
        return self.order(term) + 1, TEMPERATURE_ORDER + 1


EFFECTS: tuple[type[Effect], ...] = (
    ScaleFactor,
    ScaleFactorTemperature,
    ScaleFactorAsymmetry,
    ScaleFactorEven,
    ScaleFactorOdd,
    SineResponse,
    Saturation,
    RateTemperatureSurface,
)
