"""Size of an effect in noise units: z, the whitened norm of the signal that a model cannot absorb."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.evidence.design import Design
from labctl.fitting.criticism.evidence.elimination import eliminate_base
from labctl.fitting.criticism.evidence.noise_grid import Noise, expected_drift_dps
from labctl.fitting.criticism.model_comparison import design_of
from labctl.fitting.criticism.reduction import ReducedRecording, reduce_recording
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.models.presets import usual_model
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording

#: Most steps of the search for a size, and the relative error in z at which it ends.
ROUNDS, CLOSE = 8, 0.08
#: Largest step of the search, in the logarithm of the size.
LARGEST_STEP = 4.0
#: Range of d log z / d log size.
MIN_SLOPE, MAX_SLOPE = 0.3, 6.0


@dataclass(frozen=True)
class SizeReference:
    """A recording without the effect, beside the published model for such a recording."""

    data: ReducedRecording
    designs: Mapping[str, Design]  #: by axis, without options
    drift_dps: float


def size_reference(recording: Recording) -> SizeReference:
    """Return the reference that a recording makes. Raises NotEnoughData where it cannot determine the model."""
    data = reduce_recording(recording, outliers=False)
    model = usual_model(fit_data_of(recording))
    designs = {axis: replace(design_of(data, model, axis, {}), options=[]) for axis in map(str, data.info.axes)}
    info = data.info
    return SizeReference(data, designs, expected_drift_dps(info.technology or "", info.stability_dps))


def size_in_noise_units(reference: SizeReference, recording: Recording) -> tuple[float, float]:
    """Return z and the share that the model cannot absorb, 0 to 1, of what a recording has beside the reference.

    The recording has the same schedule and noise as the reference, and the effect. Both figures are those of the axis
    with the largest z.
    """
    other = reduce_recording(recording, outliers=False)
    best = (0.0, 0.0)
    for axis, design in reference.designs.items():
        difference = other.output[axis] - reference.data.output[axis]
        chi2_left = _chi2(reference, axis, design.base, design.precision, difference)
        whole = _chi2(reference, axis, design.base[:, :, :0], design.precision[:0], difference)
        best = max(best, (float(np.sqrt(chi2_left)), float(np.sqrt(chi2_left / whole)) if whole > 0 else 0.0))
    return best


def _chi2(
    reference: SizeReference, axis: str, base: NDArray[np.float64], precision: Array, difference: NDArray[np.float64]
) -> float:
    """Return the whitened squared norm of a difference (R, m) beside a base (R, m, k)."""
    data = reference.data
    assert data.white_var is not None
    white = data.white_var[axis]
    scale = np.repeat(np.sqrt(white)[None, :], len(difference), axis=0)
    design = replace(reference.designs[axis], base=base, precision=precision)
    noise = Noise(reference.drift_dps, 0.0, 0.0)
    return max(eliminate_base(design, difference, white, scale, [noise])[0].chi2, 0.0)


def size_for_z(z_of: Callable[[float], float], z: float, start: float) -> float | None:
    """Return the size at which `z_of` is z, within `CLOSE`; None where no size was found.

    By the secant method in logarithms, from `start`, whose sign the size keeps.
    """
    logs: list[tuple[float, float]] = []
    at, slope = float(np.log(abs(start))), 1.0
    for _ in range(ROUNDS):
        size = float(np.copysign(np.exp(at), start))
        z_at_size = z_of(size)
        if z_at_size > 0 and abs(z_at_size / z - 1) < CLOSE:
            return size
        logs.append((at, float(np.log(max(z_at_size, 1e-3)))))
        if len(logs) > 1 and abs(logs[-1][0] - logs[-2][0]) > 1e-6:
            secant = (logs[-1][1] - logs[-2][1]) / (logs[-1][0] - logs[-2][0])
            slope = float(np.clip(secant, MIN_SLOPE, MAX_SLOPE))
        at += float(np.clip((np.log(z) - logs[-1][1]) / slope, -LARGEST_STEP, LARGEST_STEP))
    return None
