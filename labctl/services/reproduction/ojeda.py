"""Ojeda et al. 2000: the error surface of one axis, and the error per turn before and after compensation."""

from __future__ import annotations

import numpy as np

from labctl.error_per_turn import AT_REST_DPS, static_bias
from labctl.errors import BadInput, LabctlError
from labctl.fitting.numeric.arrays import Array
from labctl.papers import ojeda2000 as paper
from labctl.progress import report_stage
from labctl.services.reproduction import ojeda_data_sheet as sheet
from labctl.services.reproduction import ojeda_figures as figures
from labctl.services.reproduction.findings import Findings, Missing, Value
from labctl.services.reproduction.ojeda_surface import Surface, surface_of
from labctl.services.reproduction.sources import Measured, Rest, shipped, simulated

BENCH = "ojeda-paper-sim"
OSU = (
    "OSU-FOG-2024 is a real fibre-optic gyro of another maker, measured on a stepper table and heated from 37 to 49 "
    "deg C. The recording of this gyro ships with labctl; the recording contains means at constant rates, but no "
    "readings at rest."
)
RD2100 = (
    "RD2100 is a simulated unit like that of the paper, read at 10 Hz with the recipe ojeda2000 (21 rates, 25 to 45 "
    "deg C). It was given a ripple over the rate that the fitted surface cannot follow, so large that the errors after "
    "compensation are those of the paper's Figs. 7 and 9; the paper names no cause, and the shape is an assumption. "
    "Its errors after compensation are therefore built in; the real gyro shows how well the method works."
)
#: What the simulated unit was given: its range, and the ripple that decides what compensation leaves.
BUILT_IN = frozenset(
    {"sheet_range", "left_max", "ratio", "heldout_ratio", "turn_after", "turn_after_share", "turn_ratio",
     "turn_max_ratio", "raw_max", "turn_before"}
)  # fmt: skip
RECORD = "labctl campaign start ojeda2000: the rates +-100 deg/s every 10 at 25 to 45 deg C every 2"


def reproduce_own() -> Findings:
    """Return the paper by the real gyro that comes with labctl and by the simulated unit of the paper."""
    findings = Findings(values=sheet.of_printed()).told("computed")
    findings.add(_of(shipped("osu-fog", OSU), None).told("measured"))
    simulated_unit = simulated("ojeda2000", BENCH, "RD2100, simulated", RD2100)
    findings.add(_of(simulated_unit, None).told("simulated", BUILT_IN.__contains__))
    return findings


def reproduce(measured: Measured, axis: str | None) -> Findings:
    """Return what a unit's recording gives of the paper. Raises BadInput for an axis that it does not have."""
    findings = Findings(values=sheet.of_printed())
    findings.add(_of(measured, axis))
    return findings


def _of(measured: Measured, axis: str | None) -> Findings:
    findings = Findings(sources=[measured.sentence])
    axes: list[str] = list(measured.recording.info.axes)
    if axis is not None and axis not in axes:
        raise BadInput(f"--axis {axis!r}: the recording has axes {', '.join(axes)}; choose one of them")
    axis = axis or axes[0]
    surface = None
    report_stage(f"fit ojeda2000 to {measured.name}")
    try:
        surface = surface_of(measured, axis)
    except LabctlError as error:
        findings.missing.append(Missing("Figures 3 to 9, eqs. 9 to 14", str(error), RECORD))
    if surface is not None:
        findings.values += _of_surface(surface)
        findings.add(sheet.of_recording(surface, measured.recording.info.max_rate_dps))
        drawn, lacking = figures.of_surface(surface)
        findings.figures += drawn
        findings.missing += lacking
    if measured.rest is None:
        findings.missing.append(
            Missing(
                f"Figure 1 and eqs. 1 and 15 of {measured.name}",
                "the recording contains means of data sets, or no readings at rest",
                "readings of one data set at rate 0, 10 s or more",
            )
        )
    else:
        _of_rest(findings, measured, measured.rest, axis, surface)
    return findings


def _rms(values: Array) -> float | None:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if len(finite) else None


def _most(values: Array) -> float | None:
    finite = values[np.isfinite(values)]
    return float(np.abs(finite).max()) if len(finite) else None


def _over(before: float | None, after: float | None) -> float | None:
    return before / after if before is not None and after else None


def _of_surface(surface: Surface) -> list[Value]:
    error = surface.result.error
    rates = f"{len(surface.rate_dps)} data sets up to {np.abs(surface.rate_dps).max():.0f} deg/s"
    temperature_text = f"{surface.temperature_c.min():.0f} to {surface.temperature_c.max():.0f} deg C"
    coefficients = len(surface.result.fitted.axes[surface.axis].names)
    before, after = surface.turn_before_deg, surface.turn_after_deg
    largest_after = _most(after)
    sentences = {
        "coefficients": (coefficients, "cubic in rate, parabola in temperature"
                         if coefficients == 12 else "with misalignment, since the unit has several axes"),
        "raw_max": (_most(surface.raw_dps), f"another unit than the paper's: {rates}, {temperature_text}"),
        "left_max": (_most(surface.left_dps), "the paper gives a figure only"),
        "ratio": (_over(_rms(surface.raw_dps), _rms(surface.left_dps)),
                  f"larger where more of the error is smooth; {_rms(surface.left_dps):.4f} deg/s RMS are left"),
        "heldout_ratio": (_over(error.raw_rms_dps, error.heldout_rms_dps),
                          ("the paper tests the fit on its own data; here each temperature is predicted by a fit "
                          "to the others")),
        "turn_before": (_most(before), "static bias at each temperature from the data sets at rest"),
        "turn_after": (largest_after, "the paper gives a share of the turn only"),
        "turn_after_share": (None if largest_after is None else largest_after / 3.6, "share of 360 deg"),
        "turn_ratio": (_over(_rms(before), _rms(after)), "RMS of all data sets from 5 deg/s on"),
        "turn_max_ratio": (_over(_most(before), largest_after),
                           "the largest errors are at the slowest rates, where a turn takes longest and drift counts"),
    }  # fmt: skip
    return [Value(name, surface.name, None if value is None else float(value), reason)
            for name, (value, reason) in sentences.items()]  # fmt: skip


def _of_rest(findings: Findings, measured: Measured, rest: Rest, axis: str, surface: Surface | None) -> None:
    begun = rest.t_s < paper.STATIC_S
    readings = rest.rate_dps[axis][begun]
    findings.figures.insert(0, figures.at_rest(measured.name, rest.t_s[begun], readings))
    try:
        bias = static_bias(readings)
    except LabctlError as error:
        findings.missing.append(
            Missing("Eqs. 1 and 15", str(error), "readings of one data set at rate 0, 10 s or more")
        )
        return
    at_rest = "contains the Earth's rate about the axis; another unit than the paper's"
    findings.values += [
        Value("readings", measured.name, float(bias.readings), "readings in the first 10 s"),
        Value(
            "arw_rate",
            measured.name,
            float(bias.u_dps * np.sqrt(rest.t_s[begun][-1]) * 3600.0),
            "white noise of the first 10 s; the data sheet gives a typical value",
        ),
        Value(
            "arw_angle",
            measured.name,
            float(bias.u_dps * np.sqrt(rest.t_s[begun][-1]) * 60.0),
            "the same white noise",
        ),
        Value("bias_before", measured.name, bias.bias_dps, at_rest),
        Value("u_bias", measured.name, bias.u_dps, "scatter of these readings over the root of their number"),
    ]
    if surface is not None:
        still = np.abs(surface.rate_dps) <= AT_REST_DPS
        if np.any(still):
            first = int(np.flatnonzero(still)[0])
            residual = bias.bias_dps - (surface.output_dps[first] - surface.left_dps[first] - surface.rate_dps[first])
            findings.values.append(
                Value("bias_after", measured.name, float(residual), "the surface takes off its value at rest (eq. 15)")
            )
