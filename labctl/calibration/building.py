"""Making the document of a calibration from a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date, datetime
from importlib.metadata import version as package_version

from labctl.answers.budget import BudgetJson, UncertaintyJson
from labctl.answers.calibration_file import AxisEvidenceJson, CalibrationJson, OutputUnitJson
from labctl.answers.json_object import JsonObject
from labctl.calibration.document import SCHEMA, Calibration, limits
from labctl.canonical_json import hash_of
from labctl.fitting import FitResult, FittedModel, coefficients_json
from labctl.fitting.models.force_sensitivity import specific_force_json
from labctl.fitting.models.memory import state_json
from labctl.fitting.models.paper_units import in_paper_units
from labctl.fitting.uncertainty import AxisEvidence, BenchConditions, conditions_of, response_budgets
from labctl.fitting.uncertainty.document import Covered, uncertainty_json
from labctl.recording import OutputUnit, RecordingInfo

HOW_TO_USE = (
    "rate = (output - offset) / scale per axis; then the model's error is taken off: argument 'output' "
    "subtracts it as a function of that rate, 'rate' solves rate = true + error(true) for the true rate"
)


def build_calibration(
    info: RecordingInfo,
    result: FitResult,
    *,
    version: int,
    parent: int | None,
    issued_at: datetime,
    provenance: JsonObject,
    evidence: Mapping[str, AxisEvidence] | None = None,
    used_on: Sequence[date] = (),
) -> Calibration:
    """Make the document of a fit. What belongs to bench, fixture or environment is left out, and named.

    `evidence`, by axis, is what the uncertainty in use is computed from; without it that is unknown. `used_on` are the
    days of several recordings, on which the standards of the bench were used; default: the day of `info`.
    """
    exported, left_out = result.exported()
    bench = conditions_of(info, result.environment, used_on, result.mountings, result.angles_rad)
    use = {axis: one.to_json() for axis, one in (evidence or {}).items()}
    document: CalibrationJson = {
        "schema": SCHEMA,
        "serial": info.serial,
        "version": version,
        "parent": parent,
        "issued_at": issued_at.isoformat(),
        "unit": {"model": info.model, "technology": info.technology},
        "software": {"name": "labctl", "version": package_version("labctl")},
        "axes": list(exported.axes),
        "output": {axis: _unit_json(info.output.get(axis, OutputUnit())) for axis in info.axes},
        "model": exported.to_dict(),
        "coefficients": {axis: coefficients_json(exported.model, fit) for axis, fit in exported.axes.items()},
        "papers": in_paper_units(exported),
        "left_out": left_out,
        "error": result.error.to_dict(),
        "noise": dict(result.noise),
        "environment": result.environment,
        "validity": {"temperature_c": list(result.temperature_c), "rate_dps": list(result.rate_dps)},
        "use": use,
        "standards": bench.to_json(),
        "uncertainty": _uncertainty(exported, result, use, bench),
        "provenance": dict(provenance),
        "how_to_use": HOW_TO_USE,
        "hash": "",
    }
    if response := _response(result, use, bench):
        document["response"] = response
    _add_where_known(document, info, result, exported)
    document["hash"] = hash_of(document)
    return Calibration(document)


def _add_where_known(document: CalibrationJson, info: RecordingInfo, result: FitResult, exported: FittedModel) -> None:
    """Add what only some calibrations have."""
    if info.configuration:
        document["configuration"] = dict(info.configuration)
    if (force := specific_force_json(result.fitted)) is not None:
        document["specific_force"] = force
    if (state := state_json(exported)) is not None:
        document["state"] = state
    if result.poses is not None:
        document["poses"] = result.poses


def _uncertainty(
    exported: FittedModel, result: FitResult, use: Mapping[str, AxisEvidenceJson], bench: BenchConditions
) -> UncertaintyJson | None:
    """Return the bound of a document, computed from the model as it is exported."""
    covered = Covered(limits(result.rate_dps), limits(result.temperature_c))
    return uncertainty_json(exported, covered, _evidence(use), bench)


def _response(
    result: FitResult, use: Mapping[str, AxisEvidenceJson], bench: BenchConditions
) -> dict[str, dict[str, BudgetJson]]:
    """Return axis -> budgets of delay and time constant, which a document leaves out of its model."""
    budgets = response_budgets(result.fitted, evidence=_evidence(use), bench=bench)
    return {axis: {name: budget.to_json() for name, budget in named.items()} for axis, named in budgets.items()}


def _evidence(use: Mapping[str, AxisEvidenceJson]) -> dict[str, AxisEvidence]:
    return {axis: AxisEvidence.from_json(one) for axis, one in use.items()}


def _unit_json(output: OutputUnit) -> OutputUnitJson:
    return {"unit": output.unit, "scale": output.scale, "offset": output.offset}
