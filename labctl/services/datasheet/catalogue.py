"""The lines of a data sheet: name, unit, the specification it is compared with, and what measures it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

RATES = "a recipe of several rates of both signs, such as ojeda2000 or table1-x-table2"
THREE = "a recipe that turns the unit about x, y and z, such as table1-x-table2 or quick-triaxial"
TEMPERATURES = "a recipe of several temperatures, such as ojeda2000 or table1-x-table2"


@dataclass(frozen=True)
class Line:
    """One characteristic. `key` names its specification in `[datasheet]` of a recording or a bench file."""

    id: str
    title: str
    unit: str
    key: str | None
    measured_by: str
    specified_as: Literal["at most", "at least"] = "at most"
    per_axis: bool = True


LINES = (
    Line("scale_factor", "Scale factor, output over rate", "1", None, RATES),
    Line("scale_factor_nonlinearity", "Scale factor nonlinearity, of full scale", "ppm",
         "scale_factor_nonlinearity_ppm", RATES),
    Line("scale_factor_asymmetry", "Scale factor asymmetry", "ppm", "scale_factor_asymmetry_ppm", RATES),
    Line("scale_factor_repeatability", "Scale factor repeatability, turn-on to turn-on", "ppm",
         "scale_factor_repeatability_ppm", "recipe turn-on-20"),
    Line("scale_factor_temperature", "Scale factor temperature sensitivity", "ppm/deg C",
         "scale_factor_temperature_ppm_c", TEMPERATURES),
    Line("bias", "Bias", "deg/s", "bias_dps", RATES),
    Line("bias_temperature", "Bias temperature sensitivity", "deg/s/deg C", "bias_temperature_dps_c", TEMPERATURES),
    Line("bias_repeatability", "Bias repeatability, turn-on to turn-on", "deg/s", "bias_repeatability_dps",
         "recipe turn-on-20"),
    Line("g_sensitivity", "Bias sensitivity to specific force", "deg/s/g", "g_sensitivity_dps_g",
         "recipe six-face-tumble"),
    Line("angle_random_walk", "Angle random walk N", "deg/s/rtHz", "angle_random_walk_dps_rthz",
         "recipe static-night"),
    Line("bias_instability", "Bias instability B", "deg/s", "bias_stability_dps", "recipe static-night"),
    Line("rate_random_walk", "Rate random walk K", "deg/s/sqrt(s)", "rate_random_walk_dps_rts",
         "recipe static-night"),
    Line("bandwidth", "Bandwidth, -3 dB", "Hz", "bandwidth_hz",
         "recipe sine-dwell or sweeps, simulated or imported, and a fit with the effect bandwidth", "at least"),
    Line("misalignment", "Misalignment of the triad, rotation about the axis", "deg", "misalignment_deg", THREE),
    Line("orthogonality", "Orthogonality error between two axes", "deg", "orthogonality_deg", THREE),
)  # fmt: skip
#: Lines of a unit with three axes only.
OF_THREE_AXES = frozenset({"misalignment", "orthogonality"})
