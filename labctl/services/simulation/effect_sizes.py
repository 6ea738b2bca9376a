"""Size of a hidden effect on a plan, from its size in noise units."""

from __future__ import annotations

from instruments.bench_config import BenchFile, GyroSettings
from labctl.errors import BadInput
from labctl.fitting.criticism import size_for_z, size_in_noise_units, size_reference
from labctl.services.simulation.plan_simulation import hidden_recording
from procedures.planning.plan import Plan

#: Seed of the unit that sizes are computed on.
SEED = 424_242


class Sizing:
    """Sizes of hidden effects on one plan."""

    def __init__(self, plan: Plan, bench: BenchFile, gyro: GyroSettings) -> None:
        self._plan, self._bench, self._gyro = plan, bench, gyro
        self._reference = size_reference(hidden_recording(plan, bench, gyro, SEED, {}))

    def z_of(self, effect: str, size: float) -> tuple[float, float]:
        """Return z and the share that the model cannot absorb, 0 to 1, of a hidden effect of this size."""
        recording = hidden_recording(self._plan, self._bench, self._gyro, SEED, {effect: size})
        return size_in_noise_units(self._reference, recording)

    def size_of(self, effect: str, z: float, start: float) -> float:
        """Return the size that gives z, in the effect's coefficient unit, searched from `start`.

        Raises BadInput where no size does.
        """
        size = size_for_z(lambda tried: self.z_of(effect, tried)[0], z, start)
        if size is None:
            raise BadInput(
                f"effect {effect}: no size of the effect gives a signal of {z:g} standard deviations of the "
                f"noise with recipe {self._plan.recipe.name}, because this recipe can hardly show the effect; "
                "give a size in the unit of the effect"
            )
        return size
