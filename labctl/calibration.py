"""The calibration document: canonical JSON with all that a consumer needs, under a hash that no edit survives."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import date, datetime
from functools import cached_property
from importlib.metadata import version as package_version
from pathlib import Path
from typing import cast, get_args

from instruments.configuration import changed
from labctl.canonical_json import canonical, canonical_and_hash, hash_of, with_own_hash
from labctl.certification import CalibrationWarning, Certification, read_certification
from labctl.errors import BadCalibrationFile, OtherConfiguration
from labctl.fitting import FitResult, FittedModel, coefficients_json
from labctl.fitting.models.force_sensitivity import ForceSensitivity, specific_force_json
from labctl.fitting.models.memory import state_json
from labctl.fitting.models.paper_units import in_paper_units
from labctl.fitting.uncertainty import AxisEvidence, BenchConditions, conditions_of, response_budgets
from labctl.fitting.uncertainty.document import Covered, uncertainty_json
from labctl.json_types import JsonObject
from labctl.json_types.budget import BudgetJson, UncertaintyJson
from labctl.json_types.calibrations import AxisEvidenceJson, CalibrationJson, OutputUnitJson
from labctl.recording import OutputUnit, RecordingInfo
from labctl.recording.info import Axis

__all__ = [
    "SCHEMA",
    "Calibration",
    "CalibrationWarning",
    "Certification",
    "build_calibration",
    "canonical",
    "hash_of",
    "read_calibration",
    "with_certification",
]

SCHEMA = "labctl-calibration/1"
HOW_TO_USE = (
    "rate = (output - offset) / scale per axis; then the model's error is taken off: argument 'output' "
    "subtracts it as a function of that rate, 'rate' solves rate = true + error(true) for the true rate"
)
#: The largest calibration file that is read; one of 6 axes' temperature tables has a fiftieth of it.
MOST_BYTES = 64 << 20


@dataclass(frozen=True)
class Calibration:
    """A calibration as it is exported: the document, and the fitted model in it."""

    document: CalibrationJson

    @property
    def serial(self) -> str:
        """Serial number of the unit."""
        with _reading("serial"):
            return str(self.document["serial"])

    @property
    def version(self) -> int:
        """Version, counted per unit."""
        with _reading("version"):
            return int(self.document["version"])

    @property
    def hash(self) -> str:
        """SHA-256 of the canonical document without the hash."""
        return str(self.document["hash"])

    @property
    def calibration_hash(self) -> str:
        """SHA-256 of the calibration without its certification, by which certificates and exported files name it.

        A certification does not change the calibration, but it is in the file and so in `hash`.
        """
        return self.hash if self.certification is None else self.certification.calibration_hash

    @property
    def axes(self) -> tuple[str, ...]:
        """The axes that are corrected, in order."""
        with _reading("axes"):
            axes = self.document["axes"]
            if not (isinstance(axes, list) and axes and set(axes) <= set(get_args(Axis))):
                raise ValueError(f"{str(axes)[:80]} is not a list of axes; give one or more of x, y and z")
            return tuple(axes)

    @cached_property
    def fitted(self) -> FittedModel:
        """The fitted model that the document holds: sensor and package effects only."""
        with _reading("model"):
            return FittedModel.from_dict(self.document["model"])

    @cached_property
    def force_sensitivity(self) -> ForceSensitivity | None:
        """What specific force adds to the output, for a consumer with an accelerometer; None: the fit has no such term.

        `fitted` does not contain it. `ForceSensitivity.left_out` gives its effects and their size, for use without an
        accelerometer.
        """
        with _reading("specific_force"):
            given = self.document.get("specific_force")
            return None if given is None else ForceSensitivity.from_json(given, self.axes)

    @cached_property
    def bench(self) -> BenchConditions | None:
        """What is known of the bench: standards, and angles of mountings. None: an older version of labctl made it."""
        with _reading("standards"):
            given = self.document.get("standards")
            return None if given is None else BenchConditions.from_json(given)

    @property
    def output(self) -> dict[str, OutputUnit]:
        """How each axis's output becomes a rate before it is corrected."""
        with _reading("output"):
            units = {axis: OutputUnit.model_validate(unit) for axis, unit in self.document["output"].items()}
            return units | {axis: units[axis] for axis in self.axes}  # each axis has one

    @property
    def temperature_c(self) -> tuple[float, float]:
        """The calibrated temperatures; infinite where the document has null: no thermometer was there."""
        with _reading("validity"):
            return _limits(self.document["validity"]["temperature_c"])

    @property
    def rate_dps(self) -> tuple[float, float]:
        """The calibrated rates; infinite where the document has null: nothing of the model depends on the rate."""
        with _reading("validity"):
            return _limits(self.document["validity"]["rate_dps"])

    @property
    def configuration(self) -> dict[str, str]:
        """How the unit was set when it was measured, as it said itself; empty where it says nothing."""
        with _reading("configuration"):
            return {str(name): str(value) for name, value in self.document.get("configuration", {}).items()}

    def require_configuration(self, reported: Mapping[str, str]) -> None:
        """Raise OtherConfiguration where the unit now reports another setting than when it was measured.

        `reported` is what it says of itself, by the same names; what only one of the two has is not compared.
        """
        if found := changed(self.configuration, reported):
            said = ", ".join(f"{name} was {was} and is {now}" for name, (was, now) in found.items())
            raise OtherConfiguration(
                f"calibration of {self.serial} version {self.version}: the unit is set otherwise than when it was "
                f"measured: {said}; set it as it was, or calibrate it as it is"
            )

    @property
    def certification(self) -> Certification | None:
        """The certification at the time when the file was fetched; None: it was not certified then."""
        with _reading("certification"):
            given = self.document.get("certification")
            return None if given is None else read_certification(given)

    def warning(self, now: datetime) -> str:
        """Return the warning for a user at an aware time: overdue, or revoked. Empty where there is nothing."""
        known = self.certification
        return "" if known is None else known.warning(f"{self.serial} version {self.version}", now)

    def to_bytes(self) -> bytes:
        """Return the bytes that are stored and served, always the same."""
        return canonical(self.document) + b"\n"


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
    covered = Covered(_limits(result.rate_dps), _limits(result.temperature_c))
    return uncertainty_json(exported, covered, _evidence(use), bench)


def _response(
    result: FitResult, use: Mapping[str, AxisEvidenceJson], bench: BenchConditions
) -> dict[str, dict[str, BudgetJson]]:
    """Return axis -> budgets of delay and time constant, which a document leaves out of its model."""
    found = response_budgets(result.fitted, evidence=_evidence(use), bench=bench)
    return {axis: {name: budget.to_json() for name, budget in named.items()} for axis, named in found.items()}


def _evidence(use: Mapping[str, AxisEvidenceJson]) -> dict[str, AxisEvidence]:
    return {axis: AxisEvidence.from_json(one) for axis, one in use.items()}


def with_certification(content: bytes, known: Certification) -> tuple[bytes, str]:
    """Return the bytes of a calibration file with its certification, and their hash, which covers it."""
    whole, found = with_own_hash({**json.loads(content), "certification": known.to_json()})
    return whole + b"\n", found


def _limits(pair: Sequence[float | None]) -> tuple[float, float]:
    low, high = pair
    return -math.inf if low is None else float(low), math.inf if high is None else float(high)


def _unit_json(unit: OutputUnit) -> OutputUnitJson:
    return {"unit": unit.unit, "scale": unit.scale, "offset": unit.offset}


def read_calibration(source: Path | bytes) -> Calibration:
    """Read a calibration file; raises BadCalibrationFile when it is not whole, not ours, or was edited.

    A file that another parser could read otherwise, such as one with a repeated key, is refused.
    """
    name = "calibration" if isinstance(source, bytes) else str(source)
    try:
        content = source if isinstance(source, bytes) else _content(source)
        document = json.loads(content)
        schema = document.get("schema") if isinstance(document, dict) else None
        if schema != SCHEMA:
            raise BadCalibrationFile(
                f"{name}: the file has schema {repr(schema)[:80]}, but this version of labctl reads {SCHEMA!r}; "
                "use the version that wrote the file"
            )
        whole, found = canonical_and_hash(document)
        if whole != content.strip():
            json.loads(content, object_pairs_hook=_object)
    except OSError as error:
        raise BadCalibrationFile(f"{name}: cannot be read ({error.strerror}); check path and permissions") from error
    except RecursionError:
        raise BadCalibrationFile(
            f"{name}: nested too deeply for a calibration; fetch it again with `labctl calibration`"
        ) from None
    except ValueError as error:
        raise BadCalibrationFile(
            f"{name}: not JSON, or truncated ({error}); fetch it again with `labctl calibration`"
        ) from error
    written = document.get("hash")
    if found != written:
        raise BadCalibrationFile(
            f"{name}: was edited or damaged: the hash of its content is {found[:16]}…, but the file gives "
            f"{str(written)[:16]}…; fetch it again with `labctl calibration`"
        )
    return Calibration(cast(CalibrationJson, document))


def _content(path: Path) -> bytes:
    with path.open("rb") as file:
        content = file.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise ValueError(f"larger than the limit of {MOST_BYTES} bytes; check that it is a calibration file")
    return content


def _object(pairs: list[tuple[str, object]]) -> dict[str, object]:
    made = dict(pairs)
    if len(made) != len(pairs):
        keys = [key for key, _ in pairs]
        double = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"key {double[:80]!r} is repeated in one object; remove one of the two")
    return made


@contextmanager
def _reading(part: str) -> Iterator[None]:
    """Turn what goes wrong with a part of a document whose hash is right into BadCalibrationFile."""
    try:
        yield
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        first = str(error).partition("\n")[0][:200]
        raise BadCalibrationFile(
            f"calibration: its {part} cannot be read ({type(error).__name__}: {first}); fetch it again with `labctl "
            "calibration`"
        ) from error
