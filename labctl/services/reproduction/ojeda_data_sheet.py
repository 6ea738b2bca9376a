"""Table I of Ojeda et al. 2000, the data sheet of the RD2100: its rows by a recording, and by each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from labctl.fitting.numeric.arrays import Array
from labctl.papers import ojeda2000 as paper
from labctl.services.reproduction.findings import Findings, Missing, Value
from labctl.services.reproduction.ojeda_surface import Surface

#: Data sets within one kelvin are of one temperature, and so many rates draw a line over the rate.
LEVEL_C, MIN_RATES = 1.0, 5


@dataclass(frozen=True)
class Lines:
    """The straight lines of the error over the rate, one for each temperature: (levels,) each."""

    temperature_c: Array
    slope: Array
    bias_dps: Array
    left_dps: Array  #: RMS about the line


def lines_of(surface: Surface) -> Lines | None:
    """Return the lines at every temperature with enough rates; None where there is none."""
    level = np.round(surface.temperature_c / LEVEL_C)
    lines = []
    for number in np.unique(level):
        at_level = level == number
        rate, error = surface.rate_dps[at_level], surface.raw_dps[at_level]
        if len(np.unique(np.round(rate))) < MIN_RATES:
            continue
        slope, bias = np.polyfit(rate, error, 1)
        residual_dps = float(np.sqrt(np.mean((error - slope * rate - bias) ** 2)))
        lines.append((float(surface.temperature_c[at_level].mean()), float(slope), float(bias), residual_dps))
    if not lines:
        return None
    return Lines(*np.array(lines).T)


def of_printed() -> list[Value]:
    """Return what follows from the printed numbers alone: 1 (deg/h)/sqrt(Hz) is 1/60 deg/sqrt(h)."""
    of = "printed numbers"
    arw, per_bit = paper.PAPER.value("arw_rate"), paper.PAPER.value("sheet_bit")
    white = arw / 3600.0 / np.sqrt(paper.STATIC_S)
    return [
        Value("arw_angle", of, arw / 60.0, "rounded in print"),
        Value("sheet_resolution", of, 10.0 * per_bit, "one bit at 10 readings per second, if a bit is an angle in deg"),
        Value("u_bias", of, float(white), "angle random walk over the root of 10 s; bias instability, 0.002, adds"),
    ]


def of_recording(surface: Surface, max_rate_dps: float | None) -> Findings:
    """Return the rows of Table I that a recording gives, and what would give the others."""
    name, lines, findings = surface.name, lines_of(surface), Findings()
    if max_rate_dps is not None:
        stated = "as its recording states it; a setting, not a measurement"
        findings.values.append(Value("sheet_range", name, max_rate_dps, stated))
    if lines is not None:
        full, at = paper.PAPER.value("sheet_range"), int(np.argmin(np.abs(lines.temperature_c - paper.MIDDLE_C)))
        temperature_text = f"{lines.temperature_c.min():.0f} to {lines.temperature_c.max():.0f} deg C"
        straight = f"RMS about the line at {lines.temperature_c[at]:.0f} deg C, over {full:.0f} deg/s"
        findings.values += [
            Value("sheet_nonlinearity", name, float(100.0 * lines.left_dps[at] / full), straight),
            Value(
                "sheet_scale_warm",
                name,
                float(100.0 * np.ptp(lines.slope)),
                f"of the lines' slopes, {temperature_text}",
            ),
            Value("sheet_bias_warm", name, float(np.ptp(lines.bias_dps)), f"of the lines at rest, {temperature_text}"),
        ]
    findings.missing.append(
        Missing(
            f"Table I, scale per bit, bias stability, bias repeatability and bandwidth of {name}",
            "a recording contains rates, one power-on, constant rates and no long rest",
            "recipe static-night for the stability, turn-on-20 for the repeatability, sine-dwell for the bandwidth; "
            "the scale per bit is of the wire",
        )
    )
    return findings
