"""What a schedule can show before anything is measured: which effects, from which size on, and which look alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from instruments.bench_config import BenchFile
from labctl.fitting.criticism.candidates import Option, untestable_channels
from labctl.fitting.criticism.criticise import LEAST_VISIBLE
from labctl.fitting.criticism.evidence import Design, EliminatedBase, eliminate_base, slices_of, visible_share
from labctl.fitting.criticism.model_comparison import design_of
from labctl.fitting.criticism.noise_grid import USUAL_DPS, Noise
from labctl.fitting.criticism.reduction import ReducedRecording, reduce_recording
from labctl.fitting.effects import CATALOGUE
from labctl.fitting.models.error_model import ErrorModel
from labctl.services.schemas.plans import Visibility
from labctl.services.simulation.sizing import hidden_recording, usual_model
from procedures.planning.plan import Plan

#: Readings per second at which a schedule is walked through: its channels are slow.
WALK_HZ = 1.0
#: What is just detectable, in noise units.
DETECTABLE_Z = 5.0
SEED = 1


@dataclass(frozen=True)
class Schedule:
    """A plan walked through in the simulated world, beside a model: everything but the output."""

    data: ReducedRecording
    designs: dict[str, Design]
    left: dict[str, EliminatedBase]
    slices: dict[str, list[slice]]

    def options(self, axis: str) -> list[tuple[Option, slice]]:
        """Return every shape of every effect on one axis, with its place in the Gram matrix."""
        return list(zip(self.designs[axis].options, self.slices[axis], strict=True))


def walk(plan: Plan, bench: BenchFile, model: ErrorModel | None = None) -> Schedule:
    """Walk through a plan; `model` (default: the published one for such a recording) is what effects stand beside."""
    gyro = bench.gyros[0].model_copy(update={"sample_rate_hz": WALK_HZ})
    recording = hidden_recording(plan, bench, gyro, SEED, {})
    data = reduce_recording(recording, outliers=False)
    beside = model or usual_model(recording)
    stability = data.info.datasheet.get("bias_stability_dps")
    drift = Noise(stability / 2 if stability else USUAL_DPS.get(data.info.technology or "", 0.002), 0.0, 0.0)
    designs, left, slices = {}, {}, {}
    for axis in map(str, data.info.axes):
        design = design_of(data, beside, axis)
        assert data.white_var is not None
        white = data.white_var[axis]
        scale = np.repeat(np.sqrt(white)[None, :], len(data.present), axis=0)
        nothing: NDArray[np.float64] = np.zeros(data.present.shape)
        designs[axis] = design
        left[axis] = eliminate_base(design, nothing, white, scale, [drift])[0]
        slices[axis] = slices_of(design.options)
    return Schedule(data, designs, left, slices)


def visibility(plan: Plan, bench: BenchFile) -> list[Visibility]:
    """Return what a plan could find and could not, each effect with its visible share and smallest detectable size."""
    schedule = walk(plan, bench)
    absent = untestable_channels(schedule.data)
    found = [_of_effect(schedule, effect_id, absent.get(effect_id)) for effect_id in CATALOGUE]
    return sorted((v for v in found if v is not None), key=lambda v: -v.share)


def _of_effect(schedule: Schedule, effect_id: str, absent: list[str] | None) -> Visibility | None:
    if effect_id == "rate_temperature_surface":
        return None
    kind = CATALOGUE[effect_id]
    if absent:
        return Visibility(effect=effect_id, visible=False, share=0.0, why="channel", needs=absent)
    share = 0.0
    sizes: dict[str, float] = {}
    for axis in schedule.designs:
        for option, where in schedule.options(axis):
            if option.candidate != effect_id:
                continue
            here = visible_share(schedule.left[axis], where)
            share = max(share, here)
            if here < LEAST_VISIBLE:
                continue
            norms = np.sqrt(np.maximum(np.diag(schedule.left[axis].gram)[where], 0.0))
            best = int(np.argmax(norms))
            size = DETECTABLE_Z / max(float(norms[best]), 1e-300)
            sizes[option.units[best]] = min(size, sizes.get(option.units[best], np.inf))
    visible = share >= LEAST_VISIBLE
    unit = next(iter(sizes), "")  # of the lowest order that shows
    return Visibility(
        effect=effect_id,
        visible=visible,
        share=share,
        smallest_size=sizes.get(unit),
        unit=unit,
        why=None if visible else "schedule",
        experiment="" if visible else kind.experiment,
    )
