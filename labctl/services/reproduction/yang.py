"""Yang et al. 2018: K and B over temperature, errors by turning axis and output, and the effect that is missing."""

from __future__ import annotations

import tempfile
from pathlib import Path

from instruments.clock import VirtualClock
from labctl.answers.calibrations import FitRequest, ImproveRequest
from labctl.errors import BadInput, LabctlError
from labctl.fitting import FitData, FitResult, fit, fit_data_of, fit_turning, residuals
from labctl.progress import report_stage
from labctl.recording import Recording
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.calibrations.revision import improve_unit
from labctl.services.criticism.criticise import criticise_unit
from labctl.services.reproduction import yang_figures as figures
from labctl.services.reproduction import yang_numbers as numbers
from labctl.services.reproduction.findings import Findings, Missing, Value
from labctl.services.reproduction.sources import Measured, measured_from, simulated_readings
from labctl.services.reproduction.yang_errors import Judged, at_shown, left_out_errors, raw_errors
from labctl.store import Store, open_store


def demonstrate(readings: Recording, of: str) -> Findings:
    """Fit yang2018 to readings, ask what is missing, add it, and ask again."""
    with (
        tempfile.TemporaryDirectory(prefix="labctl-reproduce-") as folder,
        open_store(str(Path(folder) / "paper.sqlite"), write=True) as store,
    ):
        return _in(store, readings, of)


def _in(store: Store, readings: Recording, of: str) -> Findings:
    at, serial = VirtualClock().utc(), readings.info.serial
    number = store.recordings.add_import(readings, at)
    fitted = fit_unit(store, serial, FitRequest(recording=number, model="yang2018"), at)
    report_stage("criticise yang2018: which effect is missing")
    answer = criticise_unit(store, serial, None, None)
    error = fitted.error
    stalled = (
        f"The model yang2018 lacks an effect: it reduces the RMS error from {_said(error.raw_rms_dps)} to "
        f"{_said(error.rms_dps)} deg/s, but the noise floor is {_said(error.noise_floor_dps)} deg/s. The criticism of "
        f"the model reports: {' '.join(answer.text)}"
    )
    findings = Findings(
        story=[stalled],
        values=[
            Value("stalled", of, error.rms_dps, "bias, scale factor and misalignment cannot follow the curve"),
            Value("floor", of, error.noise_floor_dps, error.noise_floor_source),
        ],
    )
    if not answer.named:
        return findings
    added = answer.named[0]
    report_stage(f"add {added} and criticise again")
    better = improve_unit(store, serial, ImproveRequest(add=[added]), at)
    after = better.error
    again = criticise_unit(store, serial, None, None)
    findings.story.append(
        f"With {added} added, the RMS error is {_said(after.rms_dps)} deg/s, and {_said(after.heldout_rms_dps)} deg/s "
        f"at temperatures left out of the fit. The criticism of this model reports: {' '.join(again.text)}"
    )
    findings.values += [
        Value("improved", of, after.rms_dps, f"{added}, as criticism named it"),
        Value("improved_heldout", of, after.heldout_rms_dps, "each inner temperature by a fit without it"),
    ]
    return findings


def _said(value: float | None) -> str:
    return "an unknown" if value is None else f"{value:.4f}"


BENCH, RECIPE, BETWEEN = "yang-paper-sim", "yang-23-rates", "yang-between"
UNIT = "YANG-2018, simulated"
WHAT = (
    "YANG-2018 is a simulated unit with the paper's printed matrix K and bias B at 25 deg C, and a nonlinearity (a "
    "soft limit of the output) of such a size that the remaining error of each axis is the printed one: that is built "
    "in. How K and B change with temperature follows from the paper's two columns of K_g, that at 25 deg C and that of "
    "one temperature, taken as 20 deg C, the node of its Table 1 below; the scale factors are lines, as it says, "
    "the misalignments do not change, and a small parabola of the bias is an assumption. The errors of the two "
    "methods, and so what the proposed one gains, are then results of the methods."
)
HOW = (
    "The unit is calibrated with the recipe yang-23-rates (the ten temperatures of Table 1, the rates of Table 2 "
    "and +-350 deg/s, three positions). The errors are those of a second campaign, with the recipe yang-between, at "
    "nine temperatures half-way between these, which were not used in the fit; one of them is 25 deg C."
)
#: Readings per second: the noise of a data-set mean is that of 125, and the page is made sooner.
RATE_HZ = 4.0


def reproduce_own() -> Findings:
    """Return the paper by the simulated unit that has its printed K and B."""
    readings = simulated_readings(RECIPE, BENCH, seed=1, sample_rate_hz=RATE_HZ)
    calibration = measured_from(readings, UNIT, WHAT)
    between = measured_from(simulated_readings(BETWEEN, BENCH, seed=2, sample_rate_hz=RATE_HZ), UNIT, HOW)
    findings = Findings(sources=[WHAT, HOW])
    report_stage("fit yang2018 and the traditional method")
    proposed = fit(calibration.recording, "yang2018")
    traditional = fit(calibration.recording, "single_temperature")
    data = fit_data_of(between.recording)
    errors = {
        name: residuals(result.fitted, data, fit_turning(result.fitted, data))
        for name, result in (("proposed", proposed), ("traditional", traditional))
    }
    judged = Judged(
        UNIT, data, raw_errors(data), errors["traditional"], errors["proposed"], proposed.fitted, traditional.fitted,
        "second campaign, at temperatures and in readings that no fit has seen",
    )  # fmt: skip
    _take_in(findings, judged, fit_data_of(calibration.recording))
    findings.add(demonstrate(readings, UNIT))
    return findings.told("simulated", _built_in)


def _built_in(name: str) -> bool:
    """Return whether the simulated unit was given a number: K and B at 25 deg C, and what they leave of an own axis."""
    own_axis = {f"table4_{axis}_{axis}_proposed" for axis in "xy"} | {
        f"table3_{axis}_{axis}_RMS after" for axis in "xyz"
    }
    return name in own_axis or name.startswith(("proposed_", "curve_", "rate_", "temperature_"))


def reproduce(measured: Measured, axis: str | None) -> Findings:
    """Return what a unit's recording gives of the paper. Raises BadInput for an axis: the paper takes all of them."""
    if axis is not None:
        raise BadInput(f"--axis {axis!r}: paper yang2018 uses all axes of the recording together; leave --axis out")
    findings = Findings(sources=[measured.sentence])
    report_stage(f"fit yang2018 to {measured.name}")
    try:
        data = fit_data_of(measured.recording)
        result = fit(measured.recording, "yang2018")
    except LabctlError as error:
        findings.missing.append(Missing("Tables 1 to 4, figures 4 to 9", str(error), numbers.RECORD))
        return findings
    judged = left_out_errors(measured, data, result)
    findings.sources.append(f"Errors after compensation: {judged.how}.")
    _take_in(findings, judged, data)
    findings.values += _of_fit(measured.name, result)
    findings.missing.append(
        Missing(
            "The missing effect",
            "a criticism belongs to a version of the unit",
            f"labctl fit {measured.name} --model yang2018; labctl criticise {measured.name}; "
            f"labctl improve {measured.name} --add EFFECT",
        )
    )
    return findings


def _of_fit(name: str, result: FitResult) -> list[Value]:
    error = result.error
    return [
        Value("stalled", name, error.rms_dps, "on the data of the fit"),
        Value("floor", name, error.noise_floor_dps, error.noise_floor_source),
    ]


def _take_in(findings: Findings, judged: Judged, calibration: FitData) -> None:
    findings.values += [
        *numbers.conditions(judged.name, calibration), *numbers.coefficients(judged), *numbers.largest_cross(judged),
        *numbers.tables(judged), *numbers.own_axis(judged),
    ]  # fmt: skip
    findings.missing += list(numbers.lacking(judged))
    findings.figures += figures.coefficients(judged.name, judged.proposed_model)
    findings.figures += figures.errors(judged, at_shown(judged.data))
