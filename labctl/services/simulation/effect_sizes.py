"""Sizes of hidden effects on a plan: EFFECT, EFFECT=SIZE, and EFFECT=zN in noise units."""

from __future__ import annotations

from instruments.bench_config import BenchFile, GyroSettings
from labctl.answers.campaigns import CampaignRequest
from labctl.errors import BadInput
from labctl.fitting.criticism import size_for_z, size_in_noise_units, size_reference
from labctl.services.planning.loading import limits_of, load_recipe
from labctl.services.simulation.hidden_effects import hidden_sizes, is_in_noise_units, refuse_unless_simulated
from labctl.services.simulation.plan_simulation import hidden_recording
from procedures.planning.plan import Plan, make_plan

#: Seed of the unit that sizes are computed on.
SEED = 424_242
#: Readings per second of a simulated recording where none are stated, also of those that sizes are computed on.
USUAL_RATE_HZ = 10.0


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


def sizes_on_plan(texts: list[str], plan: Plan, bench: BenchFile, gyro: GyroSettings) -> dict[str, float]:
    """Return effect id -> size in its coefficient unit of what is to be hidden in a unit on a plan. Raises BadInput."""
    sizes = hidden_sizes([text for text in texts if not is_in_noise_units(text)])
    if wanted := [text.partition("=z") for text in texts if is_in_noise_units(text)]:
        usual = hidden_sizes([name for name, _, _ in wanted])
        sizing = Sizing(plan, bench, gyro)
        sizes |= {name: sizing.size_of(name, float(z), usual[name]) for name, _, z in wanted}
    return sizes


def with_sizes(request: CampaignRequest, bench: BenchFile) -> CampaignRequest:
    """Return a start with sizes in noise units converted to those of the effects, for the first unit of its bench.

    Raises BadInput, RecipeError, PlanRefused.
    """
    if not any(map(is_in_noise_units, request.hide)):
        return request
    refuse_unless_simulated(bench, request.hide)
    plan = make_plan(load_recipe(request.recipe), limits_of(bench), clip=request.clip)
    gyro = bench.gyros[0].model_copy(update={"sample_rate_hz": USUAL_RATE_HZ})
    hide = [f"{name}={size!r}" for name, size in sizes_on_plan(request.hide, plan, bench, gyro).items()]
    return request.model_copy(update={"hide": hide})
