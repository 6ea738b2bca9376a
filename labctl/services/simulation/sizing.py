"""How large a hidden effect is on a plan, in noise units.

z is the whitened size of what the model cannot absorb, on the axis that shows it best.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from instruments.bench_config import BenchFile, GyroSettings, SimulationSettings
from labctl.errors import BadInput
from labctl.fitting.criticism.evidence import eliminate_base
from labctl.fitting.criticism.model_comparison import design_of
from labctl.fitting.criticism.noise_grid import USUAL_DPS, Noise
from labctl.fitting.criticism.reduction import ReducedRecording, reduce_recording
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.presets import changed, preset_for
from labctl.recording import Recording
from labctl.services.simulation.recordings import simulate
from procedures.planning.plan import Plan

ROUNDS = 8
CLOSE = 0.08
#: The seed of the unit that sizes are worked out on.
SEED = 424_242


def hidden_recording(
    plan: Plan, bench: BenchFile, gyro: GyroSettings, seed: int, hidden: dict[str, float]
) -> Recording:
    """Return a simulated recording with effects hidden in its unit."""
    settings = (bench.simulation or SimulationSettings()).model_copy(update={"seed": seed, "hidden": hidden})
    return simulate(plan, bench.model_copy(update={"gyros": (gyro,), "simulation": settings}), gyro)


def usual_model(recording: Recording) -> ErrorModel:
    """Return the published model that fits a recording's axes: what a size is measured beside."""
    context = fit_data_of(recording)
    name = "yang2018" if len(recording.info.axes) > 1 and context.levels is not None else "ojeda2000"
    model, _ = preset_for(name, []).build(context)
    return changed(model).build(context)[0]


class Sizing:
    """Sizes on one plan."""

    def __init__(self, plan: Plan, bench: BenchFile, gyro: GyroSettings) -> None:
        self._plan, self._bench, self._gyro = plan, bench, gyro
        self._plain = hidden_recording(plan, bench, gyro, SEED, {})
        self._data = reduce_recording(self._plain, outliers=False)
        model = usual_model(self._plain)
        designs = {axis: design_of(self._data, model, axis, {}) for axis in map(str, self._data.info.axes)}
        self._designs = {axis: replace(design, options=[]) for axis, design in designs.items()}
        stability = self._data.info.datasheet.get("bias_stability_dps")
        self._drift = stability / 2 if stability else USUAL_DPS.get(self._data.info.technology or "", 0.002)

    def z_of(self, effect: str, size: float) -> tuple[float, float]:
        """Return (z, the share of the effect that the model cannot absorb) of a hidden effect of this size."""
        recording = hidden_recording(self._plan, self._bench, self._gyro, SEED, {effect: size})
        other = reduce_recording(recording, outliers=False)
        best = (0.0, 0.0)
        for axis, design in self._designs.items():
            difference = other.output[axis] - self._data.output[axis]
            left = self._norm(design.base, design.precision, difference, axis)
            whole = self._norm(design.base[:, :, :0], design.precision[:0], difference, axis)
            best = max(best, (float(np.sqrt(left)), float(np.sqrt(left / whole)) if whole > 0 else 0.0))
        return best

    def _norm(self, base: np.ndarray, precision: np.ndarray, difference: np.ndarray, axis: str) -> float:
        data: ReducedRecording = self._data
        assert data.white_var is not None
        white = data.white_var[axis]
        scale = np.repeat(np.sqrt(white)[None, :], len(difference), axis=0)
        design = replace(self._designs[axis], base=base, precision=precision)
        return max(eliminate_base(design, difference, white, scale, [Noise(self._drift, 0.0, 0.0)])[0].chi2, 0.0)

    def size_of(self, effect: str, z: float, start: float) -> float:
        """Return the size that gives z. Raises BadInput where no size does."""
        logs: list[tuple[float, float]] = []
        at, slope = float(np.log(abs(start))), 1.0
        for _ in range(ROUNDS):
            found, _ = self.z_of(effect, float(np.copysign(np.exp(at), start)))
            if found > 0 and abs(found / z - 1) < CLOSE:
                return float(np.copysign(np.exp(at), start))
            logs.append((at, float(np.log(max(found, 1e-3)))))
            if len(logs) > 1 and abs(logs[-1][0] - logs[-2][0]) > 1e-6:
                slope = float(np.clip((logs[-1][1] - logs[-2][1]) / (logs[-1][0] - logs[-2][0]), 0.3, 6.0))
            at += float(np.clip((np.log(z) - logs[-1][1]) / slope, -4.0, 4.0))
        raise BadInput(
            f"effect {effect}: no size gives z = {z:g} on recipe {self._plan.recipe.name}; "
            "this schedule cannot show it, or hardly; give a size in its own unit"
        )
