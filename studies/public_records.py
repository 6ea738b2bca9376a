"""The public recordings of a unit whose model can be criticised: other orders of axes, and what was put aside.

The verdict has to be the same when the axes change their names and the columns their order. What is advised by a part
of a recording is added to the model, exported, and tried on the part that was put aside: every third data set, the
middle third, or the last third in time.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.fitting.criticism import Criticism, criticise
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.estimation.axis_solutions import residuals
from labctl.fitting.estimation.error_metrics import rms
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.presets import changed, preset_for
from labctl.recording import Recording, read_recording, to_points
from studies.real.answers import Commands

#: File, map, and the models that a user would begin with.
RECORDS = (
    ("freeimu-warmup.parquet", "freeimu-warmup", ("bias", "bias_temperature")),
    ("pan-cooldown.parquet", "pan-cooldown", ("bias", "bias_temperature")),
    ("osu-rate-table.csv", "osu-rate-table", ("bias_scale", "ojeda2000")),
)
#: Data sets from which on a recording is divided between them.
FEW_SETS = 12
#: The name that each axis gets when they change places.
NEXT_AXIS = {"x": "y", "y": "z", "z": "x"}


def recording_of(file: str, column_map: str) -> Recording:
    """Return a published file as it is imported by its map."""
    with TemporaryDirectory() as folder:
        commands, out = Commands(Path(folder)), str(Path(folder) / "recording")
        commands.taken(file, column_map)
        commands.json("export", "recording", "1", "--out", out)
        return read_recording(Path(out))


def turned(recording: Recording) -> Recording:
    """Return a recording whose axes have changed their names, and whose columns stand in the opposite order."""
    axes = tuple(sorted(NEXT_AXIS[axis] for axis in recording.info.axes))
    output = {NEXT_AXIS[axis]: unit for axis, unit in recording.info.output.items()}
    columns = {}
    for name in reversed(list(recording.columns)):
        values = recording.columns[name]
        parts = [NEXT_AXIS.get(part, part) for part in name.split("_")]
        if name == "position":
            values = np.array([str(each)[:-1] + NEXT_AXIS[str(each)[-1]] for each in np.asarray(values)])
        columns["_".join(parts)] = values
    return Recording(recording.info.model_copy(update={"axes": axes, "output": output}), columns, recording.environment)


def criticised(recording: Recording, model: str) -> tuple[FitResult, Criticism]:
    """Return a fit by a preset and its criticism."""
    points = to_points(recording)
    base = fit_preset(fit_data_of(points), preset_for(model, []))
    return base, criticise(recording, base.fitted.model, points=points)


def said(found: Criticism) -> tuple[str, tuple[str, ...], tuple[str, ...]]:
    """Return the form of a verdict, what it names, and what is advised."""
    advised = tuple(each["effect"] for each in found.advice if each["add"])
    return found.verdict.form, tuple(sorted(found.verdict.named)), advised


def parts_of(recording: Recording) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Yield how a recording is divided, and which rows are put aside, (n,)."""
    dataset = np.asarray(recording.columns["dataset"])
    place = np.unique(dataset, return_inverse=True)[1]
    if place.max() < FEW_SETS:  # a rest is one data set: its readings are divided
        place = np.arange(len(dataset))
    else:
        yield "every third", place % 3 == 1
    third = (int(place.max()) + 1) / 3
    yield "middle third", (place >= third) & (place < 2 * third)
    yield "last third", place >= 2 * third


def left(result: FitResult, recording: Recording, low_c: float, high_c: float) -> float:
    """Return what the export leaves of the data sets within some temperatures, deg/s."""
    points = to_points(recording)  # at temperatures that the fit has not seen nothing is promised
    warm = np.asarray(points.columns["temperature_c"], dtype=np.float64)
    inside = (warm >= low_c) & (warm <= high_c)
    if not inside.any():
        return math.nan
    points = replace(points, columns={name: np.asarray(values)[inside] for name, values in points.columns.items()})
    return rms(residuals(result.fitted.exported()[0], fit_data_of(points), {})) or 0.0


def lines() -> Iterator[str]:
    """Yield the results, record by record."""
    for file, column_map, models in RECORDS:
        recording = recording_of(file, column_map)
        for model in models:
            _, found = criticised(recording, model)
            _, other = criticised(turned(recording), model)
            same = "same" if said(found) == said(other) else f"OTHER: {said(other)}"
            yield f"{column_map:16} {model:17} {said(found)}; axes and columns in another order: {same}"
            for how, aside in parts_of(recording):
                yield f"{'':16} {model:17} {how:12} {_tried(recording, model, aside)}"


def _tried(recording: Recording, model: str, aside: NDArray[np.bool_]) -> str:
    """Return what is advised by the rows that are not put aside, and what it makes of those."""
    seen, following = (
        replace(recording, columns={name: np.asarray(values)[rows] for name, values in recording.columns.items()})
        for rows in (~aside, aside)
    )
    try:
        base, found = criticised(seen, model)
    except NotEnoughData as error:
        return f"no fit: {error}"
    advised = said(found)[2]
    terms = tuple(term for term in found.verdict.terms.values() if term.effect in advised)
    low_c, high_c = base.temperature_c
    before = left(base, following, low_c, high_c)
    if math.isnan(before):
        return f"{said(found)[0]}: nothing was put aside at temperatures that were seen"
    if not terms:
        return f"{said(found)[0]}: nothing advised, {before:.4g} deg/s"
    after = left(fit_preset(fit_data_of(to_points(seen)), changed(base.fitted.model, terms)), following, low_c, high_c)
    better = "better" if after < before else "WORSE"
    return f"{said(found)[0]}: {', '.join(advised)} advised, {before:.4g} to {after:.4g} deg/s, {better}"


def run() -> str:
    """Return the results."""
    return "\n".join(lines())


if __name__ == "__main__":
    for line in lines():
        print(line, flush=True)
