"""Profiles of simulated units: scale, alignment, bias, noise and thermal behaviour."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from instruments.simulators.physics.ageing import Ageing, ageing_of

Array = NDArray[np.float64]
#: temperature (n,) deg C -> (n, axes, 3): gain of each axis for the rates along x, y and z
Gain = Callable[[Array], Array]
#: temperature (n,) deg C -> bias (n, axes) deg/s
Offset = Callable[[Array], Array]
#: own rates (n, axes) deg/s, temperature (n,) deg C -> nonlinearity (n, axes) deg/s
Bend = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class UnitTruth:
    """True properties of one simulated unit. Models that are fitted to its data share no formula with it."""

    axes: tuple[str, ...]
    gain: Gain
    offset: Offset
    bend: Bend | None
    white_dps_rthz: float
    instability_dps: float
    instability_taus_s: tuple[float, ...] = (120.0, 700.0, 3600.0)
    thermometer_noise_c: float = 0.01
    sensor_tau_s: float = 720.0
    self_heating_c: float = 3.0
    heating_tau_s: float = 600.0
    deep_tau_s: float = 420.0
    supply_v: float = 5.0
    warm_up: Callable[[Array], Array] | None = field(default=None)  #: (seconds since power-on (n,)) -> (n,) deg/s
    sample_clock_ppm: float = 0.0  #: by how much more readings come than the bench file says
    ageing: Ageing | None = None  #: None: the unit stays as it is
    accel_noise_g: float = 0.0  #: of a reading of its accelerometers, where its stream has them

    def k(self, temperature_c: float) -> Array:
        """Return K at a temperature, (axes, 3): K[output, input]."""
        return self.gain(np.array([temperature_c]))[0]

    def b(self, temperature_c: float) -> Array:
        """Return the bias at a temperature, (axes,) deg/s."""
        return self.offset(np.array([temperature_c]))[0]


def _matrices(matrix: Array, diagonal: Array, rows: list[int]) -> Array:
    """Return rows of a 3 x 3 matrix, (n, rows, 3), with what is added to its diagonal, (n, 3)."""
    flat = np.empty((len(diagonal), 9))
    flat[:] = matrix.ravel()
    flat[:, ::4] += diagonal
    matrices = flat.reshape(-1, 3, 3)
    return matrices if rows == [0, 1, 2] else matrices[:, rows]


def mems_triaxial(axes: tuple[str, ...], rng: np.random.Generator) -> UnitTruth:
    """Make a tri-axial MEMS unit like that of Yang et al. 2018 (K at 25 deg C as published, signs reconstructed)."""
    published = np.array([[0.0005, 0.0188, 0.0012], [-0.0187, 0.0005, 5.2e-4], [0.0011, 7.5e-4, 0.0017]])
    k25 = np.eye(3) + published * rng.normal(1.0, 0.05, (3, 3))
    slope = rng.normal(0.0, 6e-5, 3)
    level = np.array([-0.0303, -0.0435, -0.0261]) * rng.normal(1.0, 0.1, 3)
    tilt, curve = rng.normal(0.0, 4e-4, 3), rng.normal(0.0, 5e-6, 3)
    rows = ["xyz".index(axis) for axis in axes]

    def gain(temperature_c: Array) -> Array:
        return _matrices(k25, slope * (temperature_c[:, None] - 25.0), rows)

    def offset(temperature_c: Array) -> Array:
        from_25_c = temperature_c[:, None] - 25.0
        return (level + tilt * from_25_c + curve * from_25_c * from_25_c)[:, rows]

    return UnitTruth(axes, gain, offset, None, 0.01, 0.0015)


#: Yang et al. 2018, Table 2 and +-350 deg/s: the rates that their printed errors belong to (RMS 210.6 deg/s).
YANG_RATES_DPS = np.array(
    [0.0, *(sign * rate for rate in (0.1, 1, 10, 50, 100, 150, 200, 250, 300, 350, 400) for sign in (1, -1))]
)
#: Their K at 25 deg C, [output, input], and B, deg/s; signs reconstructed. What K and B leave of their own axes, deg/s
#: RMS: Table 4 (proposed) for x and y, Table 3 (after) for z.
YANG_K = np.array([[1.0005, 0.0188, 0.0012], [-0.0187, 1.0005, 5.2027e-4], [0.0011, 7.5133e-4, 1.0017]])
YANG_B_DPS = np.array([-0.0303, -0.0435, -0.0261])
YANG_LEFT_DPS = np.array([0.0931, 0.0957, 0.0263])
#: Temperature of their traditional vector, which they do not print: the node of Table 1 below 25 deg C. Their B there,
#: and by how much their own scale factors are higher there: K_g prints 1.001 for 1.0005 about x and 1.0001 for 1.0005
#: about y; within that rounding, the root of the difference of the squares of Table 4 over the RMS of the rates.
YANG_SINGLE_C = 20.0
YANG_K_SINGLE = np.array([4.11e-4, -4.09e-4, 0.0])
YANG_B_SINGLE_DPS = np.array([-0.0316, -0.0488, -0.0232])
#: Their temperatures are those of the turntable; a little heat keeps one node clearly the nearest to 25 deg C.
YANG_HEATING_C = 0.3


def yang_paper(axes: tuple[str, ...], _: np.random.Generator) -> UnitTruth:
    """Make the unit of Yang et al. 2018: printed K and B, and a soft limit that leaves what they print after their fit.

    How its scale factors and its bias change with temperature follows from the two columns of K_g: the traditional one
    is of a single temperature, `YANG_SINGLE_C`. The curve of the bias is an assumption.
    """
    rows = ["xyz".index(axis) for axis in axes]
    apart_c = YANG_SINGLE_C - 25.0
    slope, tilt = YANG_K_SINGLE / apart_c, (YANG_B_SINGLE_DPS - YANG_B_DPS) / apart_c
    curve = np.array([5e-6, -4e-6, 3e-6])
    cubes = YANG_RATES_DPS**3
    bent = cubes - _line(cubes) * YANG_RATES_DPS
    limit_dps = np.sqrt(np.sqrt(np.mean(bent**2)) / (3.0 * YANG_LEFT_DPS))[rows]  # tanh begins as x - x^3 / 3
    soft = limit_dps[:, None] * np.tanh(YANG_RATES_DPS / limit_dps[:, None]) - YANG_RATES_DPS
    line = np.array([_line(each) for each in soft])

    def gain(temperature_c: Array) -> Array:
        return _matrices(YANG_K, slope * (temperature_c[:, None] - 25.0), rows)

    def offset(temperature_c: Array) -> Array:
        from_25_c = temperature_c[:, None] - 25.0
        return (YANG_B_DPS + tilt * from_25_c + curve * from_25_c * from_25_c)[:, rows]

    def bend(own_dps: Array, temperature_c: Array) -> Array:
        """Return the soft limit less its straight line over the paper's rates, which the printed K contains."""
        del temperature_c
        return limit_dps * np.tanh(own_dps / limit_dps) - own_dps - line * own_dps

    return UnitTruth(axes, gain, offset, bend, 0.01, 0.0015, self_heating_c=YANG_HEATING_C)


def _line(values: Array) -> float:
    """Return the least-squares slope of values (23,) over the paper's rates."""
    return float(values @ YANG_RATES_DPS / (YANG_RATES_DPS @ YANG_RATES_DPS))


def rd2100(axes: tuple[str, ...], rng: np.random.Generator) -> UnitTruth:
    """Make an E-Core RD2100 like that of Ojeda et al. 2000: about 2 deg/s off at 100 deg/s, and warm-sensitive."""
    lot = rng.normal(1.0, 0.1, 6)
    inputs = ["xyz".index(axis) for axis in axes]

    def gain(temperature_c: Array) -> Array:
        u = (temperature_c - 35.0) / 10.0
        scale = 1.0 + 0.024 * lot[0] + u * (0.008 * lot[1] + u * 0.0015 * lot[2])
        k = np.zeros((len(temperature_c), len(axes), 3))
        for row, column in enumerate(inputs):
            k[:, row, column] = scale
        return k

    def offset(temperature_c: Array) -> Array:
        u = (temperature_c - 35.0) / 10.0
        return np.repeat((0.03 * lot[3] + u * (0.07 * lot[4] - 0.02 * u))[:, None], len(axes), axis=1)

    def bend(own_dps: Array, temperature_c: Array) -> Array:
        v = own_dps / 100.0
        u = ((temperature_c - 35.0) / 10.0)[:, None]
        return v * v * (0.08 * lot[5] - v * (0.6 + 0.05 * u))

    return UnitTruth(axes, gain, offset, bend, 0.0014, 0.0011, self_heating_c=1.5)


#: What Ojeda et al. 2000 show after compensation: an order of magnitude below the error before, Fig. 7, and less than
#: 2 % of a turn, Fig. 9. Largest ripple, deg/s, its period, deg/s, and the rate below which it vanishes, deg/s.
RIPPLE_DPS, RIPPLE_PERIOD_DPS, RIPPLE_FROM_DPS = 0.27, 37.0, 25.0


def rd2100_paper(axes: tuple[str, ...], rng: np.random.Generator) -> UnitTruth:
    """Make the RD2100 of Ojeda et al. 2000 with what its compensation left.

    The paper does not say what that is: here a ripple over the rate that moves with temperature, as the demodulator of
    an open-loop gyro makes it.
    """
    ideal = rd2100(axes, rng)
    assert ideal.bend is not None
    smooth = ideal.bend

    def bend(own_dps: Array, temperature_c: Array) -> Array:
        square = own_dps * own_dps
        moved = 0.9 * (temperature_c[:, None] - 35.0) / 10.0
        ripple = np.sin(2.0 * np.pi * own_dps / RIPPLE_PERIOD_DPS + moved)
        return smooth(own_dps, temperature_c) + RIPPLE_DPS * ripple * square / (square + RIPPLE_FROM_DPS**2)

    return replace(ideal, bend=bend)


def gyrostar(axes: tuple[str, ...], rng: np.random.Generator) -> UnitTruth:
    """Make a Gyrostar ENV-05S like that of the Weiss report: its offset is the problem, and it warms itself."""
    lot = rng.normal(1.0, 0.05, 3)
    inputs = ["xyz".index(axis) for axis in axes]

    def gain(temperature_c: Array) -> Array:
        k = np.zeros((len(temperature_c), len(axes), 3))
        hump = 1.0 + 0.003 * lot[0] * np.exp(-(((temperature_c - 23.0) / 6.0) ** 2)) - 0.0003
        for row, column in enumerate(inputs):
            k[:, row, column] = hump
        return k

    def offset(temperature_c: Array) -> Array:
        volts = 2.488 + 0.06 * lot[1] * np.tanh((temperature_c - 20.5) / 5.5)
        return np.repeat(((volts - 2.5) / 0.022)[:, None], len(axes), axis=1)

    def warm_up(on_s: Array) -> Array:
        return 1.2 * lot[2] * np.exp(-on_s / 75.0)

    return UnitTruth(
        axes, gain, offset, None, 0.003, 0.003, (60.0, 600.0), 0.02, 300.0, 3.0, 100.0, 300.0, 10.0, warm_up
    )  # fmt: skip


PROFILES: dict[str, Callable[[tuple[str, ...], np.random.Generator], UnitTruth]] = {
    "mems-triaxial": mems_triaxial,
    "yang-paper": yang_paper,
    "rd2100": rd2100,
    "rd2100-paper": rd2100_paper,
    "gyrostar": gyrostar,
}

#: Profile of a unit without one in the bench file, by driver.
DEFAULT_PROFILES = {
    "stim300": "mems-triaxial",
    "kvh-rd2100": "rd2100",
    "kvh-dsp3000": "rd2100",
    "gyrostar": "gyrostar",
    "labjack-t": "gyrostar",
    "nidaq": "gyrostar",
    "mcc-daq": "gyrostar",
    "stream-format": "mems-triaxial",
    "can": "mems-triaxial",
}
#: Sampling rate of a unit, Hz, where the bench file gives none: the rate of the wire.
USUAL_RATE_HZ = {
    "stim300": 125.0, "kvh-dsp3000": 100.0, "kvh-rd2100": 10.0, "gyrostar": 10.0, "labjack-t": 1000.0, "nidaq": 1000.0,
    "mcc-daq": 1000.0,
}  # fmt: skip


def usual_rate_hz(driver: str) -> float:
    """Return the sampling rate of a unit without one in the bench file, Hz; raises ValueError where none is known."""
    if driver not in USUAL_RATE_HZ:
        raise ValueError(
            f"gyro driver {driver!r} has no default number of readings per second; set sample_rate_hz in the bench file"
        )
    return USUAL_RATE_HZ[driver]


def make_unit(driver: str, axes: tuple[str, ...], settings: Mapping[str, object], seed: list[int]) -> UnitTruth:
    """Return one unit of a profile with the deviations of the bench file; raises ValueError for unknown names."""
    remaining = dict(settings)
    remaining.pop("device", None)  # how its electronics are set is read by the simulated instrument
    profile = remaining.pop("profile", DEFAULT_PROFILES.get(driver))
    if profile is None:
        raise ValueError(
            f"gyro driver {driver!r} has no profile of a simulated unit; set one in [simulation.units] of the "
            f"bench file: {', '.join(PROFILES)}"
        )
    if not isinstance(profile, str) or profile not in PROFILES:
        raise ValueError(f"simulated unit profile {profile!r} is not known; choose one of {', '.join(PROFILES)}")
    made = PROFILES[profile](axes, np.random.default_rng(seed))
    ageing = ageing_of(remaining.pop("ageing", None), len(axes))
    names = {
        name
        for name in UnitTruth.__dataclass_fields__
        if name not in {"axes", "gain", "offset", "bend", "warm_up", "ageing"}
    }
    for name in remaining:
        if name not in names:
            raise ValueError(
                f"simulated unit has no setting {name!r}; choose one of {', '.join(sorted({*names, 'ageing'}))}"
            )
    return UnitTruth(**{**made.__dict__, **remaining, "ageing": ageing})
