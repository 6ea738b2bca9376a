"""Weiss: a vibrating gyro, muRata Gyrostar ENV-05S, for the orientation of a vehicle."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from labctl.papers.paper import Contradiction, Paper, Printed

TEMPERATURES_C = (16.0, 18.0, 19.5, 22.0, 23.0, 45.0)
SCALE_MV = (21.997, 22.007, 22.000, 22.069, 22.078, 21.991)  #: mV per deg/s
OFFSET_V = (2.428, 2.452, 2.477, 2.501, 2.525, 2.549)
#: Data sheet: scale factor, mV per deg/s; at rest, V; full rate, deg/s; change of the offset, share of full rate per K.
NOMINAL_MV, REST_V, FULL_DPS, OFFSET_SHARE_PER_K = 22.0, 2.5, 90.0, 0.001
#: Interval at which the offset is determined again, and warm-up time of the unit, s.
OFFSET_EVERY_S, WARM_UP_S = 120.0, 600.0
#: Ranges of temperature in which the offset changes steeply and slowly, deg C.
STEEP_C, FLAT_C = (16.0, 23.0), (23.0, 45.0)


def scale_deviation_pct(of: float = NOMINAL_MV) -> tuple[float, float]:
    """Return the lowest and the highest deviation of the printed scale factors from `of`, %."""
    deviation = 100.0 * (np.asarray(SCALE_MV) / of - 1.0)
    return float(deviation.min()), float(deviation.max())


def offset_slope(low_c: float, high_c: float) -> float:
    """Return the least-squares slope of the printed offsets between two temperatures, deg/s per K."""
    temperature_c = np.asarray(TEMPERATURES_C)
    in_range = (temperature_c >= low_c) & (temperature_c <= high_c)
    slope, _ = np.polyfit(temperature_c[in_range], np.asarray(OFFSET_V)[in_range], 1)
    return float(slope) / (NOMINAL_MV / 1000.0)


def _printed() -> Iterator[Printed]:
    for temperature, scale in zip(TEMPERATURES_C, SCALE_MV, strict=True):
        yield Printed(f"scale_{temperature:g}", "Scale factors", f"at {temperature:g} deg C", "mV/(deg/s)", scale)
    for temperature, offset in zip(TEMPERATURES_C, OFFSET_V, strict=True):
        yield Printed(f"offset_{temperature:g}", "Offsets at rest", f"at {temperature:g} deg C", "V", offset)
    yield Printed("scale_low", "Text", "scale factor, lowest deviation from 22 mV/(deg/s)", "%", -0.15)
    yield Printed("scale_high", "Text", "scale factor, highest deviation from 22 mV/(deg/s)", "%", 0.15)
    yield Printed("slope_steep", "Text", "change of the offset, 16 to 23 deg C", "(deg/s)/K", 0.5, "about")
    yield Printed("slope_flat", "Text", "change of the offset, 23 to 45 deg C", "(deg/s)/K", 0.5, "about")
    yield Printed("nonlinearity", "Text", "nonlinearity at one temperature, share of full scale", "%", 0.05)
    yield Printed("drift", "Result", "largest drift after 10 min, offset renewed every 2 min", "deg/min", 1.0, "below")
    yield Printed("drift_once", "Result", "drift after 10 min, offset taken once", "deg/min", None)


def _contradictions() -> Iterator[Contradiction]:
    low, high = scale_deviation_pct()
    mean = float(np.mean(SCALE_MV))
    about = scale_deviation_pct(mean)
    yield Contradiction(
        "Scale factors",
        f"+-0.15 % is claimed; the table has {low:+.4f} to {high:+.4f} % of 22 mV/(deg/s). About its own mean, "
        f"{mean:.3f}, it has {about[0]:+.2f} to {about[1]:+.2f} %.",
        "The deviation from the nominal scale factor is given, and each value of the table.",
    )
    steep, flat, ends = offset_slope(*STEEP_C), offset_slope(*FLAT_C), (OFFSET_V[4] - OFFSET_V[0]) / 0.022 / 7.0
    yield Contradiction(
        "Offsets at rest",
        f"About 0.5 (deg/s)/K is claimed; the table has {steep:.2f} between 16 and 23 deg C by least squares "
        f"({ends:.2f} from end to end) and {flat:.2f} between 23 and 45 deg C: a curve, or a lag behind the "
        "thermometer. Six points are too few to decide.",
        "Recipe gyrostar fills the gap between 23 and 45 deg C.",
    )
    limit = OFFSET_SHARE_PER_K * FULL_DPS
    yield Contradiction(
        "Data sheet",
        f"0.1 % of full scale per K are {limit:.2f} (deg/s)/K; the table's {steep:.2f} are {steep / limit:.0f} times "
        "that.",
        "The table counts.",
    )
    yield Contradiction(
        "Scale factors",
        "22,007 has a decimal comma among points.",
        "labctl reads it as 22.007, and refuses a file that mixes points and commas.",
    )
    yield Contradiction(
        "Program",
        "A wait of SecToWait x CycleTime readings with CycleTime in ms is wrong by orders of magnitude; a 32-bit angle "
        "overflows after about 1000 readings at full scale; an integer division truncates; an offset that is averaged "
        "on while the vehicle moves learns the motion; the angle creeps at standstill.",
        "Orientation uses times, 64-bit numbers, an offset from whole stretches of standstill, and holds the angle "
        "meanwhile.",
    )


PAPER = Paper(
    "weiss1995",
    "Usage of a vibrating gyroscope for orientation estimation",
    "Weiss, University of Kaiserslautern (muRata Gyrostar ENV-05S)",
    tuple(_printed()),
    tuple(_contradictions()),
)
