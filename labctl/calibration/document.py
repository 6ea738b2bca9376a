"""The calibration document: canonical JSON with all that a consumer needs, under a hash that no edit survives."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from typing import TYPE_CHECKING, cast

from instruments.configuration import changed
from labctl.answers.output_units import NominalOutput, nominal_output
from labctl.calibration.certification import Certification, read_certification
from labctl.canonical_json import canonical, canonical_and_hash
from labctl.errors import BadCalibrationFile, OtherConfiguration
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.force_sensitivity import ForceSensitivity

if TYPE_CHECKING:  # types alone; some need pydantic, which costs as much to load as the rest of a robot's program
    from pathlib import Path

    from labctl.answers.calibration_file import CalibrationJson
    from labctl.fitting.uncertainty.conditions import BenchConditions

SCHEMA = "labctl-calibration/1"
#: The largest calibration file that is read; one of 6 axes' temperature tables has a fiftieth of it.
MAX_BYTES = 64 << 20


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
            if not (isinstance(axes, list) and axes and set(axes) <= set(BODY_AXES)):
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
            force_json = self.document.get("specific_force")
            return None if force_json is None else ForceSensitivity.from_json(force_json, self.axes)

    @cached_property
    def bench(self) -> BenchConditions | None:
        """What is known of the bench: standards, and angles of mountings. None: an older version of labctl made it."""
        from labctl.fitting.uncertainty.conditions import BenchConditions  # noqa: PLC0415  needs pydantic

        with _reading("standards"):
            bench_json = self.document.get("standards")
            return None if bench_json is None else BenchConditions.from_json(bench_json)

    @property
    def output(self) -> dict[str, NominalOutput]:
        """How each axis's output becomes a rate before it is corrected."""
        with _reading("output"):
            lines = {axis: nominal_output(output) for axis, output in self.document["output"].items()}
            return lines | {axis: lines[axis] for axis in self.axes}  # each axis has one

    @property
    def temperature_c(self) -> tuple[float, float]:
        """The calibrated temperatures; infinite where the document has null: no thermometer was there."""
        with _reading("validity"):
            return limits(self.document["validity"]["temperature_c"])

    @property
    def rate_dps(self) -> tuple[float, float]:
        """The calibrated rates; infinite where the document has null: nothing of the model depends on the rate."""
        with _reading("validity"):
            return limits(self.document["validity"]["rate_dps"])

    @property
    def configuration(self) -> dict[str, str]:
        """How the unit was set when it was measured, as it said itself; empty where it says nothing."""
        with _reading("configuration"):
            return {str(name): str(value) for name, value in self.document.get("configuration", {}).items()}

    def require_configuration(self, reported: Mapping[str, str]) -> None:
        """Raise OtherConfiguration where the unit now reports another setting than when it was measured.

        `reported` is what it says of itself, by the same names; what only one of the two has is not compared.
        """
        if changes := changed(self.configuration, reported):
            changes_text = ", ".join(f"{name} was {was} and is {now}" for name, (was, now) in changes.items())
            raise OtherConfiguration(
                f"calibration of {self.serial} version {self.version}: the unit is set otherwise than when it was "
                f"measured: {changes_text}; set it as it was, or calibrate it as it is"
            )

    @property
    def certification(self) -> Certification | None:
        """The certification at the time when the file was fetched; None: it was not certified then."""
        with _reading("certification"):
            certification_json = self.document.get("certification")
            return None if certification_json is None else read_certification(certification_json)

    def warning(self, now: datetime) -> str:
        """Return the warning for a user at an aware time: overdue, or revoked. Empty where there is nothing."""
        known = self.certification
        return "" if known is None else known.warning(f"{self.serial} version {self.version}", now)

    def to_bytes(self) -> bytes:
        """Return the bytes that are stored and served, always the same."""
        return canonical(self.document) + b"\n"


def limits(pair: Sequence[float | None]) -> tuple[float, float]:
    """Return a range as numbers: null, where there is no limit, is infinite."""
    low, high = pair
    return -math.inf if low is None else float(low), math.inf if high is None else float(high)


def read_calibration(source: Path | bytes) -> Calibration:
    """Read a calibration file; raises BadCalibrationFile when it is not whole, not ours, or was edited.

    A file that another parser could read otherwise, such as one with a repeated key, is refused.
    """
    return read_source(source)


def read_source(source: Path | str | bytes) -> Calibration:
    """Return `read_calibration` of a file, also by its path as text, or of bytes."""
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
        canonical_document, digest = canonical_and_hash(document)
        if canonical_document != content.strip():
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
    if digest != written:
        raise BadCalibrationFile(
            f"{name}: was edited or damaged: the hash of its content is {digest[:16]}…, but the file gives "
            f"{str(written)[:16]}…; fetch it again with `labctl calibration`"
        )
    return Calibration(cast("CalibrationJson", document))


def _content(path: Path | str) -> bytes:
    with open(path, "rb") as file:  # noqa: PTH123  a robot's program does not load pathlib
        content = file.read(MAX_BYTES + 1)
    if len(content) > MAX_BYTES:
        raise ValueError(f"larger than the limit of {MAX_BYTES} bytes; check that it is a calibration file")
    return content


def _object(pairs: list[tuple[str, object]]) -> dict[str, object]:
    members = dict(pairs)
    if len(members) != len(pairs):
        keys = [key for key, _ in pairs]
        double = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"key {double[:80]!r} is repeated in one object; remove one of the two")
    return members


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
