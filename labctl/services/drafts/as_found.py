"""As found and as left: versions applied as they are to the recording of a draft, and what has changed between them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from labctl.answers.drafts import AppliedDraft, CoefficientChange, DriftFromVersion, RemainingLine
from labctl.answers.fitted_model import AxisCoefficients
from labctl.calibration import read_calibration
from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.models.inversion import NotConverged
from labctl.fitting.numeric.arrays import Array
from labctl.services.criticism.measurements import Measurements
from labctl.services.criticism.trend import line_left
from labctl.services.criticism.verification.of_version import applied_errors, mounting_angles_of, verify
from labctl.services.recordings.loading import motion_of
from labctl.store import CalibrationRecord, Store

#: What cannot be done with a recording or a version, as opposed to what went wrong on the way.
REFUSALS = (BadInput, NotEnoughData, NotConverged)
#: Nodes of two temperature tables at most this far apart are the same temperature, K.
SAME_NODE_K = 1.0
#: A change beyond this many standard uncertainties is significant.
COVERAGE = 2.0


def applied(store: Store, row: CalibrationRecord, measured: Measurements) -> tuple[AppliedDraft | None, str]:
    """Return what a version leaves of a recording, or None and why it cannot be applied."""
    try:
        verification = verify(store, row, measured)
        lines = _lines(row, measured)
    except REFUSALS as error:
        return None, str(error)
    applied_fields = verification.model_dump(include=set(AppliedDraft.model_fields))
    return AppliedDraft.model_validate({**applied_fields, "lines": lines}), ""


def _lines(row: CalibrationRecord, measured: Measurements) -> Mapping[str, RemainingLine]:
    if motion_of(measured.row) == "poses":  # no data set has a rate of its own
        return {}
    errors, _ = applied_errors(read_calibration(row.document), measured.points)
    data = fit_data_of(measured.points)
    return {
        axis: RemainingLine.model_validate(line_left(values, data.true_rate_dps(axis)).model_dump())
        for axis, values in errors.items()
    }


def drift_from(in_force: CalibrationRecord, draft: CalibrationRecord, measured: Measurements) -> DriftFromVersion:
    """Return how far the draft's corrected rates are from those of the version in force, and which coefficients moved.

    Raises BadInput, NotEnoughData, NotConverged where one of them cannot be applied to the recording.
    """
    difference = _difference(in_force, draft, measured)
    changes, reason = _changes(in_force, draft)
    return DriftFromVersion(
        version=in_force.version,
        largest_dps={axis: float(np.max(np.abs(values))) for axis, values in difference.items()},
        rms_dps={axis: float(np.sqrt(np.mean(values**2))) for axis, values in difference.items()},
        coefficients=changes,
        why=reason,
    )


def _difference(in_force: CalibrationRecord, draft: CalibrationRecord, measured: Measurements) -> dict[str, Array]:
    if motion_of(measured.row) == "poses":
        raise BadInput(
            "a recording of poses has no data sets at known rates, so corrected rates cannot be compared; "
            "compare the versions with `labctl verify`"
        )
    fitted = read_calibration(draft.document)
    angles = mounting_angles_of(fitted)
    old, _ = applied_errors(read_calibration(in_force.document), measured.points, angles_rad=angles)
    new, _ = applied_errors(fitted, measured.points, angles_rad=angles)
    return {axis: new[axis] - old[axis] for axis in new if axis in old}


def _changes(in_force: CalibrationRecord, draft: CalibrationRecord) -> tuple[list[CoefficientChange], str]:
    """Return each coefficient that both versions have, or none and why they do not mean the same."""
    old, new = in_force.answer, draft.answer
    first, second = old["model"], new["model"]
    if (first["effects"], first["argument"]) != (second["effects"], second["argument"]):
        reason = f"version {in_force.version} has another model ({first['name']}): only corrected rates are compared"
        return [], reason
    centres = [answer.get("reference_temperature_c") for answer in (old, new)]
    if centres[0] != centres[1]:
        return [], f"the models are centred on different temperatures, {centres[0]} and {centres[1]} deg C"
    before = list(_entries(old["axes"]))
    changes = [
        _change(entry, matching) for entry in _entries(new["axes"]) if (matching := _same(entry, before)) is not None
    ]
    return changes, "" if changes else "no coefficient is at the same temperature in both"


#: (axis, name, node in deg C or None, value, u, unit)
_Entry = tuple[str, str, float | None, float, float | None, str]


def _entries(axes: Mapping[str, AxisCoefficients]) -> Iterator[_Entry]:
    for axis, axis_answer in axes.items():
        coefficients = axis_answer["coefficients"]
        nodes = coefficients.get("temperature_c")
        for name, entry in coefficients.items():
            if not isinstance(entry, dict):
                continue
            value, u = entry["value"], entry["u"]
            if isinstance(value, list) and isinstance(u, list) and isinstance(nodes, list):
                for node, one, its_u in zip(nodes, value, u, strict=True):
                    yield axis, name, node, one, its_u, entry["unit"]
            elif not isinstance(value, list) and not isinstance(u, list):
                yield axis, name, None, value, u, entry["unit"]


def _same(entry: _Entry, others: list[_Entry]) -> _Entry | None:
    axis, name, node, *_ = entry
    for other in others:
        if other[:2] != (axis, name) or (other[2] is None) != (node is None):
            continue
        if node is None or other[2] is None or abs(other[2] - node) <= SAME_NODE_K:
            return other
    return None


def _change(entry: _Entry, before: _Entry) -> CoefficientChange:
    axis, name, node, value, u, unit_symbol = entry
    change = value - before[3]
    both = None if u is None or before[4] is None else float(np.hypot(u, before[4]))
    return CoefficientChange(
        axis=axis, coefficient=name, temperature_c=node, in_force=before[3], draft=value, change=change, u=both,
        unit=unit_symbol, significant=None if both is None else abs(change) > COVERAGE * both,
    )  # fmt: skip
