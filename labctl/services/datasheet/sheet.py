"""The performance sheet of a unit: characteristics by the newest recording that gives each, and their specification."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from labctl.answers.datasheet import Characteristic, DatasheetResponse, MeasuredUnder
from labctl.answers.noise import NoiseFigure
from labctl.answers.output_units import nominal_text
from labctl.answers.recording_head import OutputUnit
from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.data.response import TIME_CONSTANT
from labctl.progress import report_stage
from labctl.services.cache import UNNAMED, compute
from labctl.services.datasheet.measured import Figure, figures_of
from labctl.services.recordings.allan import MAX_RECORDINGS, noise_of_recordings
from labctl.services.recordings.loading import points_of
from labctl.store import RecordingRow, Store, Unit

RATES = "a recipe of several rates of both signs, such as ojeda2000 or table1-x-table2"
THREE = "a recipe that turns the unit about x, y and z, such as table1-x-table2 or quick-triaxial"
TEMPERATURES = "a recipe of several temperatures, such as ojeda2000 or table1-x-table2"


AT_USUAL = "at the temperature nearest to 25 °C, or over all temperatures where they vary continuously"
SLOPE = "slope of the best straight line through the output over the true rate, least squares over all rates"
ALLAN = "by the Allan deviation of the longest section at rest"
FROM_RUN_TO_RUN = "from one power-on to the next, at one temperature and in one position: standard deviation"


@dataclass(frozen=True)
class Line:
    """One characteristic. `key` names its specification in `[datasheet]` of a recording or a bench file."""

    id: str
    title: str
    unit: str
    key: str | None
    measured_by: str
    definition: str  #: how the figure is computed
    specified_as: Literal["at most", "at least"] = "at most"
    per_axis: bool = True


LINES = (
    Line("scale_factor", "Scale factor, relative to the nominal one", "1", None, RATES,
         f"{SLOPE}, {AT_USUAL}; over the nominal scale factor"),
    Line("scale_factor_nonlinearity", "Scale factor nonlinearity, of full scale", "ppm",
         "scale_factor_nonlinearity_ppm", RATES,
         "largest deviation from that straight line, over its slope and the fastest rate"),
    Line("scale_factor_asymmetry", "Scale factor asymmetry", "ppm", "scale_factor_asymmetry_ppm", RATES,
         "slope of the positive rates minus that of the negative ones, over their mean; both lines have one bias"),
    Line("scale_factor_repeatability", "Scale factor repeatability, turn-on to turn-on", "ppm",
         "scale_factor_repeatability_ppm", "recipe turn-on-20", f"slope of the straight line {FROM_RUN_TO_RUN}"),
    Line("scale_factor_temperature", "Scale factor temperature sensitivity", "ppm/K",
         "scale_factor_temperature_ppm_c", TEMPERATURES,
         "change of the slope of the straight line per K, linear over all temperatures"),
    Line("bias", "Bias", "deg/s", "bias_dps", RATES,
         f"output of that straight line at rate 0, {AT_USUAL}; of a unit that was never turned, mean at rest"),
    Line("bias_temperature", "Bias temperature sensitivity", "deg/s/K", "bias_temperature_dps_c", TEMPERATURES,
         "change of the bias per K, linear over all temperatures"),
    Line("bias_repeatability", "Bias repeatability, turn-on to turn-on", "deg/s", "bias_repeatability_dps",
         "recipe turn-on-20", f"bias {FROM_RUN_TO_RUN}"),
    Line("g_sensitivity", "Bias sensitivity to specific force", "deg/s/g", "g_sensitivity_dps_g",
         "recipe six-face-tumble", "rests with each axis up and down: least squares on bias and three components"),
    Line("angle_random_walk", "Angle random walk N", "deg/s/sqrt(Hz)", "angle_random_walk_dps_rthz",
         "recipe static-night", ALLAN),
    Line("bias_instability", "Bias instability B", "deg/s", "bias_stability_dps", "recipe static-night", ALLAN),
    Line("rate_random_walk", "Rate random walk K", "deg/s/sqrt(s)", "rate_random_walk_dps_rts",
         "recipe static-night", ALLAN),
    Line("bandwidth", "Bandwidth, -3 dB", "Hz", "bandwidth_hz",
         "recipe sine-dwell or sweeps, simulated or imported, and a fit with the effect bandwidth",
         "1/(2 pi time constant) of the newest version with the effect bandwidth", "at least"),
    Line("misalignment", "Misalignment of the triad, rotation about the axis", "deg", "misalignment_deg", THREE,
         "rotation of the three sensing axes as a whole against the case, from the matrix of slopes"),
    Line("orthogonality", "Orthogonality error between two axes", "deg", "orthogonality_deg", THREE,
         "90 deg minus the angle between two sensing axes, from the matrix of slopes"),
)  # fmt: skip
#: Lines of a unit with three axes only.
OF_THREE_AXES = frozenset({"misalignment", "orthogonality"})


RULE = (
    "Simple acceptance (ILAC-G8:09/2019, 4.2.1): a measured value inside the specified one passes, whatever its "
    "uncertainty; where the specified value is less than 2 u away, the risk of a wrong decision is up to 50 %."
)
BASIS = (
    "Every figure but the bandwidth is of the uncorrected output and computed by itself (IEEE Std 528 and 952). The "
    "coefficients of a calibration are other quantities: all effects of its model are fitted together, at its "
    "reference temperature, and each takes its part of the output. So a bias, scale factor or asymmetry here differs "
    "from the coefficient of the same name where the model has further effects."
)
#: A specified value less than so many standard uncertainties away is near.
NEAR = 2.0


def decided(line: Line, characteristic: Characteristic, specified: float | None) -> Characteristic:
    """Return a characteristic with the specified value and the decision on it."""
    if specified is None:
        return characteristic
    if characteristic.value is None:  # a bound below the specified value passes; one above it decides nothing
        bounded = (
            line.specified_as == "at most"
            and characteristic.at_most is not None
            and characteristic.at_most <= specified
        )
        return characteristic.model_copy(update={"specified": specified, "passed": True if bounded else None})
    value = abs(characteristic.value) if line.specified_as == "at most" else characteristic.value
    passed = value <= specified if line.specified_as == "at most" else value >= specified
    near = characteristic.u is not None and abs(value - specified) < NEAR * characteristic.u
    return characteristic.model_copy(update={"specified": specified, "passed": passed, "near_limit": near})


#: Figure of the Allan deviation, and its unit there over that of the sheet.
NOISE = {"angle_random_walk": ("N", 60.0), "bias_instability": ("B", 3600.0), "rate_random_walk": ("K", 216_000.0)}
Key = tuple[str, str, str]  #: id, axis, axis of the force


def datasheet(store: Store, serial: str) -> DatasheetResponse:
    """Return the performance sheet of a unit, from its recordings. Raises NotFound, BadInput for a unit without any."""
    unit = store.units.get(serial)
    rows = sorted(store.recordings.of_unit(unit.serial), key=lambda row: row.id, reverse=True)[:MAX_RECORDINGS]
    if not rows:
        raise BadInput(f"unit {unit.serial} has no recording: import one, or run a campaign")
    compute(UNNAMED)
    characteristics: dict[Key, Characteristic] = {}
    for row in rows:
        report_stage(f"reading recording {row.id}")
        for each in _of_recording(store, row):
            characteristics.setdefault((each.id, each.axis, each.along), each)
    for each in (*_noise(store, rows), *_bandwidth(store, unit.serial)):
        characteristics.setdefault((each.id, each.axis, each.along), each)
    return _response(unit, rows, characteristics)


def _of_recording(store: Store, row: RecordingRow) -> Iterator[Characteristic]:
    info = row.recording_info
    if row.kind == "coefficients" or info.motion not in {"rates", "rest"}:
        return
    try:
        data = fit_data_of(points_of(store, row))
    except (BadInput, NotEnoughData):
        return
    lines = {line.id: line for line in LINES}
    for figure in figures_of(data):
        found = _characteristic(lines[figure.id], figure, _conditions(row, data, figure))
        yield (
            found
            if figure.id != "scale_factor"
            else _with_nominal(found, {str(axis): output for axis, output in info.output.items()})
        )


def _with_nominal(found: Characteristic, outputs: Mapping[str, OutputUnit]) -> Characteristic:
    """Return a scale factor that states the nominal one, to which it is relative."""
    output = outputs.get(found.axis, OutputUnit())
    nominal = nominal_text(output.unit, output.offset, output.scale)
    return found.model_copy(update={"definition": f"{found.definition} ({nominal})"})


def _conditions(row: RecordingRow, data: FitData, figure: Figure) -> MeasuredUnder:
    temperature_c, rate = data.temperature_c[figure.rows], data.channels.table_rate_dps()[figure.rows]
    runs = len(np.unique(np.asarray(data.channels["run"])[figure.rows])) if "run" in data.channels else None
    return MeasuredUnder(
        recording=row.id, temperature_c=(float(temperature_c.min()), float(temperature_c.max())),
        rate_dps=(float(rate.min()), float(rate.max())), runs=runs, datasets=int(np.count_nonzero(figure.rows)),
    )  # fmt: skip


def _characteristic(line: Line, figure: Figure, conditions: MeasuredUnder) -> Characteristic:
    return Characteristic(
        id=line.id, title=line.title, axis=figure.axis, along=figure.along, value=figure.estimate.value,
        u=figure.estimate.u, unit=line.unit, conditions=conditions, specified=None, specified_as=line.specified_as,
        passed=None, definition=line.definition,
    )  # fmt: skip


def _noise(store: Store, rows: Sequence[RecordingRow]) -> Iterator[Characteristic]:
    """Yield N, B and K of the recording with the longest section at rest, by the readings of one data set."""
    answer = noise_of_recordings(store, rows)
    if answer is None or answer.recording is None:
        return
    lines = {line.id: line for line in LINES}
    temperature_c = answer.temperature_c
    under = MeasuredUnder(
        recording=answer.recording, temperature_c=None if temperature_c is None else (temperature_c, temperature_c),
        rate_dps=(0.0, 0.0), runs=1,
        datasets=answer.datasets[-1] - answer.datasets[0] + 1,
    )  # fmt: skip
    for axis, noise in answer.axes.items():
        for name, (letter, units) in NOISE.items():
            figure: NoiseFigure = {"N": noise["N"], "B": noise["B"], "K": noise["K"]}[letter]
            yield Characteristic(
                id=name, title=lines[name].title, axis=axis, value=_over(figure["value"], units),
                u=_over(figure["u"], units), at_most=_over(figure["at_most"], units), unit=lines[name].unit,
                conditions=under, specified=None, specified_as="at most", passed=None, why=figure["why"],
                definition=lines[name].definition,
            )  # fmt: skip


def _over(value: float | None, units: float) -> float | None:
    return None if value is None else value / units


def _bandwidth(store: Store, serial: str) -> Iterator[Characteristic]:
    """Yield the bandwidth of each axis by the newest version that has one."""
    line = next(each for each in LINES if each.id == "bandwidth")
    for row in store.calibrations.of_unit(serial):  # newest first
        for axis, response in row.answer["axes"].items():
            constant = response["coefficients"].get(TIME_CONSTANT)
            if not isinstance(constant, dict) or isinstance(constant["value"], list) or row.recording is None:
                continue
            tau_s, u_s = constant["value"], constant["u"]
            if tau_s <= 0 or isinstance(u_s, list):
                continue
            hertz = 1 / (2 * math.pi * tau_s)
            yield Characteristic(
                id=line.id, title=line.title, axis=axis, value=hertz, u=None if u_s is None else hertz * u_s / tau_s,
                unit=line.unit, specified=None, specified_as=line.specified_as, passed=None, definition=line.definition,
                conditions=MeasuredUnder(
                    recording=row.recording, version=row.version, temperature_c=None, rate_dps=None, runs=None,
                    datasets=None,
                ),
            )  # fmt: skip


def _response(
    unit: Unit, rows: Sequence[RecordingRow], characteristics: Mapping[Key, Characteristic]
) -> DatasheetResponse:
    infos = [row.recording_info for row in rows]
    specified: dict[str, float] = {}
    for info in reversed(infos):  # the newest recording says it last
        specified |= info.datasheet
    axes = list(dict.fromkeys(str(axis) for info in infos for axis in info.axes))
    lines = [each for line in LINES for each in _lines(line, axes, characteristics, specified)]
    decisions = [each.passed for each in lines if each.passed is not None]
    used = sorted({each.conditions.recording for each in lines if each.conditions is not None})
    measured = {each.id for each in lines if each.value is not None or each.at_most is not None}
    missing = [line.id for line in LINES if line.id not in measured and any(each.id == line.id for each in lines)]
    return DatasheetResponse(
        serial=unit.serial, model=unit.model, technology=unit.technology, recordings=used, characteristics=lines,
        passed=all(decisions) if decisions else None, not_measured=missing, basis=BASIS, decision_rule=RULE,
        text=list(_text(unit.serial, lines, decisions, missing)),
    )  # fmt: skip


def _lines(
    line: Line, axes: Sequence[str], characteristics: Mapping[Key, Characteristic], specified: Mapping[str, float]
) -> list[Characteristic]:
    """Return the lines of one characteristic; one that says what measures it where there is none."""
    if line.id in OF_THREE_AXES and len(axes) < 3:
        return []
    limit = None if line.key is None else specified.get(line.key)
    of_line = [each for (name, _, _), each in sorted(characteristics.items()) if name == line.id]
    if of_line:
        return [decided(line, each, limit) for each in of_line]
    return [
        Characteristic(
            id=line.id, title=line.title, axis="", value=None, u=None, unit=line.unit, conditions=None,
            specified=limit, specified_as=line.specified_as, passed=None, definition=line.definition,
            why=f"not measured: {line.measured_by} measures it",
        )
    ]  # fmt: skip


def _text(
    serial: str, lines: Sequence[Characteristic], decisions: Sequence[bool], missing: Sequence[str]
) -> Iterator[str]:
    if decisions:
        yield f"{serial}: {sum(decisions)} of {len(decisions)} figures with a specified value pass."
    else:
        yield (
            f"{serial}: no measured figure has a specified value; state those of the maker's data sheet in [datasheet] "
            "of the bench file or the recording."
        )
    for line in lines:
        if line.passed is False:
            axis = f", axis {line.axis}" if line.axis else ""
            yield f"{line.title}{axis}: {line.value:.3g} {line.unit}, specified {line.specified_as} {line.specified:g}."
    if missing:
        yield f"Not measured: {', '.join(name.replace('_', ' ') for name in missing)}."
