"""Twenty laws from physics that no effect of the catalogue has, in units of their own, to be added to an output.

They were written by a person who had not read what labctl searches for formulas.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf, expit

from studies.outside_catalogue import Kind

Array = NDArray[np.float64]
BOLTZMANN_EV_PER_K, ZERO_C_K = 8.617e-5, 273.15


@dataclass(frozen=True)
class Surroundings:
    """What a reading was made in; the rate is a share of the largest of the recording, with its sign."""

    columns: Mapping[str, NDArray[Any]]
    share: Array

    def _of(self, name: str) -> Array:
        return np.asarray(self.columns[name], dtype=np.float64)

    @property
    def warm_c(self) -> Array:
        """The temperature of the unit, deg C."""
        return self._of("temperature_c")

    @property
    def above_chamber_k(self) -> Array:
        """The unit's temperature over the chamber's, K."""
        return self.warm_c - self._of("chamber_c")

    @property
    def supply_v(self) -> Array:
        """The supply voltage, V."""
        return self._of("supply_v")

    @property
    def humidity_pct(self) -> Array:
        """The relative humidity, per cent."""
        return self._of("humidity_pct")

    @property
    def power_s(self) -> Array:
        """The time since the unit was switched on, s."""
        return self._of("power_s")


Shape = Callable[[Surroundings], Array]


def _lorentz_line(s: Surroundings) -> Array:
    """Return a mechanical resonance that is met at 45 % of the range, with the sign of the turning."""
    return np.asarray(np.sign(s.share) / (1 + ((np.abs(s.share) - 0.45) / 0.14) ** 2))


def _dispersion(s: Surroundings) -> Array:
    """Return the dispersive side of a line at +30 % of the range: one side of the rates alone."""
    x = (s.share - 0.3) / 0.2
    return np.asarray(x / (1 + x**2))


def _saturable(s: Surroundings) -> Array:
    """Return a saturable gain, r / (1 + r^2/a)."""
    return np.asarray(s.share / (1 + s.share**2 / 0.12))


def _turbulence(s: Surroundings) -> Array:
    """Return a torque of turbulent air, |r|^1.5, in the direction of the turning."""
    return np.asarray(np.sign(s.share) * np.abs(s.share) ** 1.5)


def _friction(s: Surroundings) -> Array:
    """Return a logarithm of the speed, alike for both directions, as friction with rate and state has."""
    return np.asarray(np.log1p(np.abs(s.share) / 0.04))


def _clipped_side(s: Surroundings) -> Array:
    """Return an amplifier's stage that conducts above +45 % of the range alone."""
    return np.maximum(s.share - 0.45, 0.0)


def _rate_fringes(s: Surroundings) -> Array:
    """Return fringes over the rate, neither odd nor even."""
    return np.asarray(np.sin(2 * np.pi * s.share / 0.62 + 0.7))


def _beats(s: Surroundings) -> Array:
    """Return the beat of two fringes over the rate."""
    return np.asarray(np.cos(2 * np.pi * s.share / 1.7) * np.cos(2 * np.pi * s.share / 0.55))


def _mode_switch(s: Surroundings) -> Array:
    """Return a switch between two modes of a laser, blurred by noise, at +15 % of the range."""
    return np.asarray(erf((s.share - 0.15) / 0.22))


def _root(s: Surroundings) -> Array:
    """Return a square root of the speed with the sign of the turning (a thin film that slips)."""
    return np.asarray(np.sign(s.share) * np.sqrt(np.abs(s.share)))


def _leakage(s: Surroundings) -> Array:
    """Return a leakage of 0.6 eV (Arrhenius) through a rectifier: times the speed, alike for both directions."""
    kelvin = s.warm_c + ZERO_C_K
    rise = np.exp(-0.6 / BOLTZMANN_EV_PER_K * (1 / kelvin - 1 / 300.0))
    return np.asarray(rise * np.abs(s.share))


def _temperature_etalon(s: Surroundings) -> Array:
    """Return the fringes of a parasitic etalon that expands: a bias over temperature, 9.3 K from one to the next."""
    return np.asarray(np.sin(2 * np.pi * s.warm_c / 9.3 + 1.1))


def _scale_etalon(s: Surroundings) -> Array:
    """Return the same in the scale factor, 11 K."""
    return np.asarray(s.share * np.cos(2 * np.pi * s.warm_c / 11.0))


def _glass_transition(s: Surroundings) -> Array:
    """Return a glue that expands from its glass transition at 36.5 deg C on."""
    return np.maximum(s.warm_c - 36.5, 0.0)


def _melting(s: Surroundings) -> Array:
    """Return a grease that melts at 34 deg C, within 1.5 K: it changes the scale factor."""
    return np.asarray(s.share * expit((s.warm_c - 34.0) / 1.5))


def _cooling_fringes(s: Surroundings) -> Array:
    """Return fringes over the rate whose contrast decays with temperature, by e in 22 K."""
    return np.asarray(np.exp(-s.warm_c / 22.0) * np.sin(2 * np.pi * s.share / 0.9))


def _moist_above(s: Surroundings) -> Array:
    """Return a film of water that grows as a square root above 43 % of humidity."""
    return np.sqrt(np.maximum(s.humidity_pct - 43.0, 0.0))


def _regulator_drop(s: Surroundings) -> Array:
    """Return a regulator that drops out below 5.02 V, in the scale factor."""
    return np.asarray(s.share * np.maximum(5.02 - s.supply_v, 0.0))


def _gradient(s: Surroundings) -> Array:
    """Return a conduction: the scale factor follows how much warmer the unit is than the chamber."""
    return np.asarray(s.share * s.above_chamber_k)


def _two_terms(s: Surroundings) -> Array:
    """Return two causes at once: a logarithm of the time since power-on, and a saturable gain."""
    return np.asarray(0.1 * np.log1p(s.power_s / 600.0) + _saturable(s))


SHAPES: dict[str, Shape] = {
    "lorentz_line": _lorentz_line, "dispersion": _dispersion, "saturable": _saturable, "turbulence": _turbulence,
    "friction": _friction, "clipped_side": _clipped_side, "rate_fringes": _rate_fringes, "beats": _beats,
    "mode_switch": _mode_switch, "root": _root, "leakage": _leakage, "temperature_etalon": _temperature_etalon,
    "scale_etalon": _scale_etalon, "glass_transition": _glass_transition, "melting": _melting,
    "cooling_fringes": _cooling_fringes, "moist_above": _moist_above, "regulator_drop": _regulator_drop,
    "gradient": _gradient, "two_terms": _two_terms,
}  # fmt: skip


def kind_of_law(name: str, largest_dps: float) -> Kind:
    """Return a law as an error of unit size; the range of rates is that of the recording where it is to be found."""
    shape = SHAPES[name]

    def law(columns: Mapping[str, NDArray[Any]], rate: Array, seed: int) -> Array:
        del seed
        fastest = float(np.abs(np.asarray(columns["table_rate_dps"], dtype=np.float64)).max())
        return shape(Surroundings(columns, rate * (fastest / largest_dps)))

    return Kind(law, ())
