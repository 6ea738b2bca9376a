"""Weiss: scale factors and offsets over temperature, and the drift of an angle whose offset is renewed at stops."""

from __future__ import annotations

import numpy as np

from labctl.answers.orientation import OrientationOptions, OrientationResponse
from labctl.answers.reproduction import PaperFigure
from labctl.errors import BadInput, LabctlError
from labctl.fitting import FitResult, fit, fit_data_of
from labctl.fitting.models.temperature import LagrangeTable
from labctl.fitting.numeric.arrays import Array
from labctl.papers import weiss1995 as paper
from labctl.progress import report_stage
from labctl.recording import OutputUnit, Recording
from labctl.services.calibrations.orientation import orientation_of_readings
from labctl.services.reproduction.findings import Findings, Missing, Value, panel, trace
from labctl.services.reproduction.sources import Measured, measured_from, shipped, simulated_readings

BENCH = "gyrostar-sim"
TABLE = (
    "WEISS-ENV05S is the table of coefficients that the report prints; the report contains no readings. The table "
    "ships with labctl."
)
SIMULATED = (
    "ENV-05S is a simulated unit like that of the report, measured at 13 rates. The report does not state the "
    "unit's deviation from the nominal values, the curve of its offset over temperature and its self-heating, so "
    "labctl's values (3 K for the self-heating) are assumptions. The chamber is simulated 3 K colder, so that the "
    "unit has the temperatures of the report."
)
AT_REST = (
    "The drift is computed from 22 min at rest at 23 deg C from power-on. These commands compute the same drift: "
    "labctl simulate gyrostar-at-rest --bench gyrostar-sim --out rest; labctl import rest; labctl orientation "
    "GYROSTAR-0001 --version 0 --warm-up-s 600 --stop-every-s 120."
)
OPTIONS = OrientationOptions(warm_up_s=paper.WARM_UP_S, stop_every_s=paper.OFFSET_EVERY_S)
RECORD_TABLE = "rates of both signs at the report's temperatures: labctl campaign start gyrostar"
RECORD_REST = "22 min at rest from power-on: labctl campaign start gyrostar-at-rest"
UNIT = "ENV-05S, simulated"


def reproduce_own() -> Findings:
    """Return the report by its own table and by a simulated unit."""
    findings = Findings()
    findings.add(_tables(shipped("weiss-gyrostar", TABLE), "z").told("measured"))
    table = simulated_readings("gyrostar-report", BENCH)
    tables = _tables(measured_from(table, UNIT, SIMULATED), "z")
    findings.add(tables.told("simulated", lambda _: True))  # the unit's laws were made after the report's table
    rest = simulated_readings("gyrostar-at-rest", BENCH)
    findings.sources.append(AT_REST)
    findings.add(_drift(rest, UNIT, "z").told("simulated"))
    return findings


def reproduce(measured: Measured, axis: str | None) -> Findings:
    """Return what a unit's recording gives of the report. Raises BadInput for an axis that it does not have."""
    axes: list[str] = list(measured.recording.info.axes)
    if axis is not None and axis not in axes:
        raise BadInput(f"--axis {axis!r}: the recording has axes {', '.join(axes)}; choose one of them")
    axis = axis or axes[0]
    findings = _tables(measured, axis)
    if measured.rest is None:
        findings.missing.append(Missing("Drift", "the recording holds no readings at rest", RECORD_REST))
        return findings
    columns = {"t_s": measured.rest.t_s, f"gyro_{axis}": measured.rest.rate_dps[axis]}
    try:
        findings.add(_drift_in(columns, measured.name, axis))
    except LabctlError as error:
        findings.missing.append(Missing("Drift", str(error), RECORD_REST))
    return findings


def _tables(measured: Measured, axis: str) -> Findings:
    """Return scale factors and offsets of a unit, in the report's units, at the report's temperatures."""
    findings = Findings(sources=[measured.sentence])
    report_stage(f"fit weiss1995 to {measured.name}")
    try:
        result = fit(measured.recording, "weiss1995")
    except LabctlError as error:
        findings.missing.append(Missing(f"Scale factors and offsets of {measured.name}", str(error), RECORD_TABLE))
        return findings
    table = result.fitted.model.temperature
    assert isinstance(table, LagrangeTable)
    nodes = np.array(table.nodes_c)
    scale, offset = _in_report_units(result, measured.recording, axis)
    is_printed = measured.recording.info.kind == "coefficients"
    for temperature in paper.TEMPERATURES_C:
        inside = nodes[0] - 0.5 <= temperature <= nodes[-1] + 0.5
        for name, values, reason in (
            ("scale", scale, "another unit: its hump near 23 deg C has another size"),
            ("offset", offset, "another unit: its curve is of the same shape, not of the same numbers"),
        ):
            value = float(np.interp(temperature, nodes, values)) if inside else None
            treatment = "taken in as it is printed" if is_printed else reason
            findings.values.append(
                Value(
                    f"{name}_{temperature:g}",
                    measured.name,
                    value,
                    treatment if inside else f"measured from {nodes[0]:.1f} to {nodes[-1]:.1f} deg C only",
                )
            )
    findings.values += _claims(measured.name, nodes, scale, offset)
    if not is_printed:
        findings.values += _nonlinearity(measured, result, axis)
    findings.figures.append(_figure(measured.name, nodes, scale, offset))
    return findings


def _in_report_units(result: FitResult, recording: Recording, axis: str) -> tuple[Array, Array]:
    """Return scale factors, mV per deg/s, and offsets, V, at the nodes.

    The nominal values are the recording's where its output is in V, else those of the report.
    """
    axis_fit = result.fitted.axes[axis]
    output_unit = next(
        (output_unit for name, output_unit in recording.info.output.items() if name == axis), OutputUnit()
    )
    volts = output_unit.scale if output_unit.unit == "V" else paper.NOMINAL_MV / 1000.0
    rest = output_unit.offset if output_unit.unit == "V" else paper.REST_V
    rows = dict(zip(axis_fit.names, axis_fit.values, strict=True))
    return (1.0 + rows["scale_factor"]) * volts * 1000.0, rest + rows["bias"] * volts


def _claims(name: str, nodes: Array, scale: Array, offset: Array) -> list[Value]:
    deviation = 100.0 * (scale / paper.NOMINAL_MV - 1.0)
    claims = [
        Value("scale_low", name, float(deviation.min()), "of the table's values; the claim is symmetric"),
        Value("scale_high", name, float(deviation.max()), "of the table's values, which exceed the claim"),
    ]
    for which, (low, high) in (("slope_steep", paper.STEEP_C), ("slope_flat", paper.FLAT_C)):
        in_range = (nodes >= low - 0.5) & (nodes <= high + 0.5)
        slope = None
        if np.count_nonzero(in_range) > 1:
            slope = float(np.polyfit(nodes[in_range], offset[in_range], 1)[0]) / (paper.NOMINAL_MV / 1000.0)
        claims.append(Value(which, name, slope, "least squares; one number for a curve" if slope is not None else
                          "fewer than two temperatures there"))  # fmt: skip
    return claims


def _nonlinearity(measured: Measured, result: FitResult, axis: str) -> list[Value]:
    data = fit_data_of(measured.recording)
    left = result.residual_dps[axis]
    full = measured.recording.info.max_rate_dps or float(np.abs(data.true_rate_dps(axis)).max())
    share = 100.0 * float(np.abs(left).max()) / full
    return [Value("nonlinearity", measured.name, share, f"largest residual of all temperatures over {full:.0f} deg/s")]


def _drift(readings: Recording, name: str, axis: str) -> Findings:
    columns = {"t_s": np.asarray(readings.columns["t_s"], dtype=np.float64), f"gyro_{axis}": readings.gyro_dps(axis)}
    return _drift_in(columns, name, axis)


def _drift_in(columns: dict[str, Array], name: str, axis: str) -> Findings:
    """Return the drift of the angle, with the offset renewed and with the offset taken once. Raises LabctlError."""
    renewed = orientation_of_readings(name, columns, OPTIONS)
    legs = renewed.drift_between_stops_deg_per_min
    if not legs:
        raise BadInput(
            f"{name}: the readings at rest after the first {paper.WARM_UP_S:g} s are too short for two stops; "
            "record for longer"
        )
    once = orientation_of_readings(
        name, columns, OrientationOptions(axis=axis, rest_s=20.0, standstill=False, warm_up_s=paper.WARM_UP_S)
    )
    worst = max(legs, key=abs)
    return Findings(
        values=[
            Value("drift", name, abs(worst), f"the largest of {len(legs)} legs between stops"),
            Value("drift_once", name, abs(once.drift_deg_per_min or 0.0), "the offset of the first 20 s kept"),
        ],
        figures=[_drift_figure(name, renewed, once)],
    )


def _drift_figure(name: str, renewed: OrientationResponse, once: OrientationResponse) -> PaperFigure:
    traces = [
        trace(label, (np.array(answer.t_s) - renewed.t_s[0]) / 60.0, answer.course_deg, "line")
        for label, answer in (("offset renewed every 2 min", renewed), ("offset taken once", once))
    ]
    return {
        "id": "drift", "title": f"Angle at rest after 10 min, {name}", "columns": 1,
        "caption": f"The angle that a vehicle at rest seems to turn by. {len(renewed.drift_between_stops_deg_per_min)} "
        "legs between declared stops of 10 s. In the first 2 s the offset is not known; then the angle is put back.",
        "panels": [panel("", "time after the warm-up, min", "angle, deg", traces)],
    }  # fmt: skip


def _figure(name: str, nodes: Array, scale: Array, offset: Array) -> PaperFigure:
    printed = (np.array(paper.TEMPERATURES_C), np.array(paper.SCALE_MV), np.array(paper.OFFSET_V))
    panels = [
        panel(title, "temperature, deg C", y, [
            trace(name, nodes, values), trace("printed", printed[0], theirs),
            trace(f"{name}: lines", nodes, values, "line"),
        ])
        for title, y, values, theirs in (
            ("scale factor", "scale factor, mV/(deg/s)", scale, printed[1]),
            ("offset at rest", "offset, V", offset, printed[2]),
        )
    ]  # fmt: skip
    return {
        "id": "table-" + "".join(c if c.isalnum() else "-" for c in name.lower()),
        "title": f"Scale factor and offset over temperature, {name}", "columns": 2,
        "caption": f"{len(nodes)} temperatures of the unit and the {len(printed[0])} printed ones, all drawn.",
        "panels": panels,
    }  # fmt: skip
