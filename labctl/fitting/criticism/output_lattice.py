"""Quantization that the lattice of an output shows: what coarse steps add to a mean, as columns of the base.

The rounding error of a mean is periodic in the true output, with the step as its period (Widrow and Kollar,
Quantization Noise, 2008). While a temperature carries the output over its codes, that sawtooth looks like a law of the
temperature. The step is read from the codes that occur, so that no raw codes are needed.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from labctl.answers.criticism import OutputStep
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording
from labctl.recording.output_steps import output_steps

#: Harmonics of the sawtooth.
HARMONICS = (1, 2, 3)
#: The steps matter where they leave this share of the variance of a mean, or more.
MIN_SHARE = 0.25


def steps_of(recording: Recording, white_var: Mapping[str, Array] | None) -> dict[str, OutputStep]:
    """Return axis -> step of the outputs whose steps matter beside the noise of the means, deg/s.

    `white_var` is the variance of the means, what the steps leave among it, (deg/s)^2; without it every step matters.
    """
    step_by_channel: dict[str, OutputStep] = {}
    for axis, step in output_steps(recording).items():
        noise = 0.0 if white_var is None else float(np.median(white_var[axis]))
        if step.left_dps**2 > MIN_SHARE * noise:
            step_by_channel[axis] = {"step_dps": step.step_dps, "left_dps": step.left_dps}
    return step_by_channel


def lattice_columns(
    data: ReducedRecording, base: NDArray[np.float64], precision: Array, axis: str
) -> tuple[NDArray[np.float64], Array]:
    """Return waves in the output of an axis with its step as their period, (R, m, k), and the precision of each.

    The output is that of a fit of the base; as its level is not known to a part of a step, both phases are given.
    """
    step = data.steps.get(axis)
    if step is None:
        return np.zeros((*data.present.shape, 0)), np.zeros(0)
    error = data.error_dps(axis)[0]
    columns = np.vstack([base[0], np.diag(np.sqrt(precision))])
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    values, *_ = np.linalg.lstsq(columns / size, np.concatenate([error, np.zeros(len(precision))]), rcond=1e-9)
    expected = data.output[axis][0] - error + base[0] @ (values / size)
    turns = 2.0 * np.pi * expected / step["step_dps"]
    waves = [wave(k * turns) / k for k in HARMONICS for wave in (np.cos, np.sin)]
    rows = data.rows_of(np.repeat(np.column_stack(waves), len(data.nodes) // len(data), axis=0))
    # the variance of all together is the one that the steps leave in a mean
    each = step["left_dps"] / np.sqrt(np.sum(np.array(HARMONICS, dtype=np.float64) ** -2.0))
    return rows, np.full(len(waves), 1.0 / each**2)
