"""Bias over temperature with each eighth of the temperatures left out in turn: autopilots' formulas, and labctl."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from labctl.fitting import fit
from labctl.recording import Recording, read_recording
from studies.real.answers import Commands
from studies.real.independent.files import AXES, Array, root_mean_square
from studies.rest_peers import Law, ardupilot, px4

PARTS = 8
#: Temperatures of means by two ways that are the same, K.
SAME_K = 1e-3
Readings = tuple[Array, Array, NDArray[np.int64]]


@dataclass(frozen=True)
class LeftOut:
    """Errors of means that a fit has not seen, deg/s: over all eighths, and over those inside the range."""

    all_parts: float
    inner: float

    @classmethod
    def of(cls, errors: Mapping[int, Array]) -> LeftOut:
        """Return the root mean squares of the errors of each part."""
        inner = [errors[part] for part in range(1, PARTS - 1)]
        return cls(root_mean_square(np.concatenate(list(errors.values()))), root_mean_square(np.concatenate(inner)))


def parts_of(warm: Array) -> NDArray[np.int64]:
    """Return which of eight parts of equal count in temperature each mean is in, (n,) from 0."""
    return np.argsort(np.argsort(warm, kind="stable"), kind="stable") * PARTS // len(warm)


def by_peers(readings: Readings, means: tuple[Array, Array], rate_hz: float) -> dict[str, LeftOut]:
    """Return name of a peer -> error. `readings` are temperatures, outputs (n, 3) and the mean that each belongs to."""
    warm, rates, window = readings
    part = parts_of(means[0])
    methods: dict[str, Callable[[Array, Array], Law]] = {
        "PX4, process_sensor_caldata (cubic)": px4,
        "ArduPilot, tempcal_IMU (cubic)": lambda there, values: ardupilot(there, values, rate_hz),
    }
    found = {}
    for peer, method in methods.items():
        errors = {}
        for out in range(PARTS):
            seen, tested = (part != out)[window], part == out
            laws = [method(warm[seen], rates[seen, k]) for k in range(len(AXES))]
            errors[out] = np.concatenate([means[1][tested, k] - law(means[0][tested]) for k, law in enumerate(laws)])
        found[peer] = LeftOut.of(errors)
    return found


def points_of(name: str) -> Recording:
    """Return the means that labctl makes of a published recording: one of each data set."""
    with TemporaryDirectory() as folder:
        commands, out = Commands(Path(folder)), str(Path(folder) / "points")
        commands.taken(f"{name}.parquet", name)
        commands.json("export", "recording", "1", "--out", out, "--points")
        return read_recording(Path(out))


def by_labctl(points: Recording, means: tuple[Array, Array]) -> LeftOut:
    """Return the same of labctl's parabola: fitted to means that labctl made itself, tested on those of the peers."""
    warm = np.asarray(points.columns["temperature_c"], dtype=np.float64)
    part, errors = parts_of(means[0]), {}
    for left_out in range(PARTS):
        there = means[0][part == left_out]
        model = fit(
            _rows(points, (warm < there.min() - SAME_K) | (warm > there.max() + SAME_K)), "bias_temperature"
        ).fitted
        centred = there - model.model.reference.temperature_c
        design = np.column_stack([np.ones(len(centred)), centred, centred**2])
        laws = [design @ model.axes[axis].values[:, 0] for axis in points.info.axes]
        errors[left_out] = np.concatenate([means[1][part == left_out, k] - law for k, law in enumerate(laws)])
    return LeftOut.of(errors)


def _rows(points: Recording, kept: NDArray[np.bool_]) -> Recording:
    return Recording(points.info, {name: np.asarray(values)[kept] for name, values in points.columns.items()})
