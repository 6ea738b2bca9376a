"""Coefficients that a fit holds at known values: read from a TOML document or from a calibration file of labctl."""

from __future__ import annotations

import tomllib
from pathlib import Path

from pydantic import ValidationError

from instruments.toml_documents import listed, read_toml, shown
from labctl.answers.fixed_coefficients import LONGEST, FixedCoefficients
from labctl.answers.json_object import JsonObject
from labctl.calibration import Calibration, read_calibration
from labctl.errors import BadInput
from labctl.fitting.estimation.held import Fixed
from labctl.fitting.models.fitted_model import AxisFit, FittedModel
from labctl.fitting.models.held import HeldCoefficient
from labctl.fitting.models.temperature import LagrangeTable
from labctl.fitting.numeric.json_numbers import none_for_nan

AXES = ("x", "y", "z")
#: How a file begins that is a calibration; no TOML document does.
BEGINS = b"{"


def read_fixed(path: Path) -> FixedCoefficients:
    """Return the coefficients of a file.

    Raises BadInput, naming file, axis, coefficient and value; BadCalibrationFile for one that is not whole.
    """
    try:
        with path.open("rb") as file:
            is_calibration = file.read(64).lstrip().startswith(BEGINS)
        if is_calibration:
            return _of_calibration(path, read_calibration(path))
        return checked_fixed(read_toml(path), str(path))
    except OSError as error:
        raise BadInput(f"{path}: cannot be read ({error.strerror or error}); name an existing file") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BadInput(f"{path}: neither TOML nor a calibration file ({error}); correct it") from error


def checked_fixed(document: JsonObject, name: str) -> FixedCoefficients:
    """Return the coefficients of a document; its name stands for a source that it does not state. Raises BadInput."""
    try:
        coefficient_document = FixedCoefficients.model_validate({**document, "file": name[-LONGEST:]})
    except ValidationError as error:
        raise BadInput(f"{name}: {_complaints(error)}; correct it (docs/how-to/known-coefficients.md)") from error
    return (
        coefficient_document
        if coefficient_document.source
        else coefficient_document.model_copy(update={"source": Path(name).name[:LONGEST]})
    )


def _complaints(error: ValidationError) -> str:
    """Return what is wrong, once for each coefficient or key."""
    complaints: dict[tuple[int | str, ...], str] = {}
    for each in error.errors():
        loc = each["loc"]
        place = loc[:2] if loc[:1] and loc[0] in AXES else loc[:1]
        text = each["msg"].removeprefix("Value error, ")
        if each["type"] == "extra_forbidden" and len(loc) == 1:
            text = "is neither an axis (x, y, z) nor one of source, reference_temperature_c"
        coefficient_name = f"axis {place[0]}: {place[1]}" if len(place) == 2 else str(place[0])
        if len(loc) > 2 and loc[2] != "value":
            coefficient_name += f", {loc[2]}"
        complaints.setdefault(place, f"{coefficient_name} = {shown(each['input'])}: {text}")
    return listed(complaints.values())


def _of_calibration(path: Path, calibration: Calibration) -> FixedCoefficients:
    fitted = calibration.fitted
    document = {
        "source": f"calibration {calibration.serial} version {calibration.version}, sha256 {calibration.hash}",
        "file": str(path)[-LONGEST:],
        "reference_temperature_c": fitted.model.reference.temperature_c,
        "argument": fitted.model.argument,
        "output": {axis: line._asdict() for axis, line in calibration.output.items()},
        "only_of_model": True,
        **{axis: _coefficients(fitted, fit) for axis, fit in fitted.axes.items()},
    }
    return FixedCoefficients.model_validate(document)


def _coefficients(fitted: FittedModel, fit: AxisFit) -> dict[str, JsonObject]:
    table = fitted.model.temperature
    coefficients: dict[str, JsonObject] = {}
    for effect, name, unit, values, us in zip(
        fit.effects, fit.names, fit.units, fit.values.tolist(), none_for_nan(fit.u), strict=True
    ):
        entry: dict[str, object] = {"effect": effect, "unit": unit, "value": values[0], "u": us[0]}
        if isinstance(table, LagrangeTable) and effect not in fitted.model.steady:
            entry |= {"value": values, "u": us, "temperature_c": list(table.nodes_c)}
        coefficients[name] = entry
    return coefficients


def fixed_of(request: FixedCoefficients | None) -> Fixed | None:
    """Return a request's coefficients as a fit takes them; None without any."""
    if request is None:
        return None
    axes = {
        axis: {
            name: HeldCoefficient(one.values, one.us, one.unit or "", one.effect or "", tuple(one.temperature_c or ()))
            for name, one in getattr(request, axis).items()
        }
        for axis in AXES
    }
    return Fixed(
        {axis: names for axis, names in axes.items() if names},
        request.file or request.source or "fixed coefficients",
        request.source or request.file,
        request.reference_temperature_c,
        request.argument,
        {str(axis): output_unit for axis, output_unit in request.output.items()},
        request.only_of_model,
    )
