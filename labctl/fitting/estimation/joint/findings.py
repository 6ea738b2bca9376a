"""Findings of a fit to several recordings: repeatability, agreement, and each recording predicted by the others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from labctl.errors import NotEnoughData
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.joined import recordings_in
from labctl.fitting.data.shifts import KINDS, ShiftKind, shifts_of
from labctl.fitting.estimation.axis_solutions import AxisSolutions, fit_turning, residuals, solve_axes
from labctl.fitting.estimation.error_metrics import rms
from labctl.fitting.estimation.joint.agreement import agreement_of, of_each_recording
from labctl.fitting.estimation.requirements import require_enough_data
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.inversion import NotConverged
from labctl.fitting.models.presets import Preset
from labctl.fitting.numeric.arrays import Array
from labctl.json_types.joint import EffectAgreement, HeldOutRecording, JointJson, RepeatabilityJson, ShiftJson

#: Probability of such shifts from noise alone below which they are said to be there.
SEEN = 0.01
#: A smaller probability is said to be smaller than this.
SMALLEST = 1e-12


def joint_findings(data: FitData, model: ErrorModel, preset: Preset, found: AxisSolutions) -> JointJson | None:
    """Return what several recordings say together; None for a single one. `found` is the fit to all of them."""
    recordings = recordings_in(data.channels.columns)
    if len(recordings) < 2:
        return None
    repeatability = {axis: _repeatability(data, axis, found) for axis in data.outputs}
    agreement, not_compared = agreement_of(data, model, found.solutions)
    held_out, pooled = _held_out(data, preset)
    return {
        "recordings": recordings,
        "repeatability": repeatability,
        "agreement": agreement,
        "not_compared": not_compared,
        "held_out": held_out,
        "heldout_rms_dps": rms(pooled),
        "text": [*_of_shifts(repeatability), *_of_agreement(agreement, not_compared, recordings)],
    }


def _repeatability(data: FitData, axis: str, found: AxisSolutions) -> list[RepeatabilityJson]:
    """Return the spread of each kind of shift of one axis, with the shifts themselves."""
    shifts, solution = shifts_of(data.channels, axis), found.solutions[axis]
    begin = len(solution.values) - len(shifts)
    u = np.sqrt(np.maximum(np.diag(solution.covariance)[begin:], 0.0))
    lines: list[RepeatabilityJson] = []
    present: set[ShiftKind] = {shift.kind for shift in shifts}
    for kind, component in zip(sorted(present), solution.components, strict=True):
        own: list[ShiftJson] = [
            {
                "recording": shift.recording, "number": shift.number, "along": shift.along,
                "value": float(solution.values[begin + k]), "u": float(u[k]),
            }
            for k, shift in enumerate(shifts)
            if shift.kind == kind
        ]  # fmt: skip
        lines.append(
            {
                "kind": kind, "term": KINDS[kind].term, "unit": KINDS[kind].unit,
                "value": component.value, "u": component.u, "low": component.low, "high": component.high,
                "freedom": component.groups, "p_value": component.p_value, "seen": component.p_value < SEEN,
                "shifts": own,
            }
        )  # fmt: skip
    return sorted(lines, key=lambda line: list(KINDS).index(line["kind"]))


def _held_out(data: FitData, preset: Preset) -> tuple[list[HeldOutRecording], dict[str, Array]]:
    """Return the error on each recording of a fit to the others, and all these errors by axis.

    The recording's own shifts are not known in advance, so they are part of the error; the direction of north is.
    """
    of, lines = np.asarray(data.channels["recording"]), []
    pooled: dict[str, list[Array]] = {axis: [] for axis in data.outputs}
    for number, left_out in of_each_recording(data).items():
        seen = data.take(of != number)
        try:
            model, rows = preset.build(seen)
            require_enough_data(seen.take(rows), model)
            fitted = FittedModel(model, solve_axes(seen.take(rows), model).fits)
            errors = residuals(fitted, left_out, fit_turning(fitted, left_out))
        except (NotEnoughData, NotConverged) as error:
            lines.append(HeldOutRecording(recording=number, rms_dps=None, why=str(error)))
            continue
        lines.append(HeldOutRecording(recording=number, rms_dps=rms(errors), why=""))
        for axis, values in errors.items():
            pooled[axis].append(values)
    return lines, {axis: np.concatenate(parts) for axis, parts in pooled.items() if parts}


def _of_shifts(repeatability: Mapping[str, list[RepeatabilityJson]]) -> Iterator[str]:
    for axis, lines in repeatability.items():
        for line in lines:
            if not line["freedom"]:
                continue
            unit = "" if line["unit"] == "1" else f" {line['unit']}"
            if not line["seen"]:
                yield f"Axis {axis}: no {line['term']}, beyond the noise; at most {line['high']:.2g}{unit}."
                continue
            values = [shift["value"] for shift in line["shifts"]]
            size = f"{line['value']:.2g}{unit} (95 %: {line['low']:.2g} to {line['high']:.2g})"
            yield (
                f"Axis {axis}: shifts of up to {max(values) - min(values):.2g}{unit} between the recordings "
                f"({_probability(line['p_value'])}) are {line['term']}: standard deviation {size}. These shifts are "
                "neither a drift nor part of the calibration."
            )


def _probability(p_value: float | None) -> str:
    """Return "p = 0.003", or "p < 1e-12" for one so small that its figures mean nothing."""
    return f"p = {p_value:.2g}" if p_value is not None and p_value > SMALLEST else f"p < {SMALLEST:g}"


def _of_agreement(agreement: list[EffectAgreement], not_compared: str, recordings: list[int]) -> Iterator[str]:
    if not_compared:
        yield f"The recordings could not be compared effect by effect: {not_compared}."
        return
    numbers = ", ".join(map(str, recordings))
    apart = [each for each in agreement if not each["agree"]]
    for each in apart:
        beside = each["chi2_beside_shifts"] is not None
        chi2 = each["chi2_beside_shifts"] if beside else each["chi2"]
        freedom = each["freedom_beside_shifts"] if beside else each["freedom"]
        p_value = each["p_value_beside_shifts"] if beside else each["p_value"]
        more = " beside the shift between them" if beside else ""
        yield (
            f"Recordings {numbers} disagree on {each['effect']}{more}: chi2 {chi2:.3g} for {freedom} degrees of "
            f"freedom, {_probability(p_value)}; a single value for all recordings is an average of different values."
        )
    if agreement and not apart:
        yield f"Recordings {numbers} agree on every effect of the model beside the shifts between them."
