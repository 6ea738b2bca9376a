"""Which size of a hidden effect gives which z on which protocol: effect_sizes.json, by `-m studies.effect_sizes`.

A size belongs to a schedule, a simulated unit and a model, so it is worked out once and kept with the code. With names
of effects after the command only their sizes are worked out anew.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Collection
from concurrent.futures import ProcessPoolExecutor
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from instruments.simulation import hidden_defaults
from labctl.fitting.criticism.effect_size import CLOSE
from labctl.fitting.effects import CATALOGUE
from labctl.services.simulation.effect_sizes import Sizing
from studies.campaigns import PROTOCOLS, protocol

FILE = Path(__file__).with_name("effect_sizes.json")
COMMAND = "python -m studies.effect_sizes"
Z_LEVELS = (5.0, 10.0, 20.0, 30.0, 100.0)
#: A protocol cannot show an effect of which less than this share is visible beside the model.
MIN_VISIBLE = 0.15
#: z is taken to be proportional to the size when it is at both ends of the levels, to within this share.
STRAIGHT = 0.03
#: A size may be this many times the noticeable size, or as many times less.
FARTHEST = 1e3
ROUNDS = 16
#: Effects that are known and subtracted (the Earth's rate), that the mean of many noisy readings hides at any size, or
#: that change the thermometer and so everything.
NOT_DRAWN = frozenset(
    {"earth_rate", "quantization", "self_heating", "thermometer_error", "bias", "scale_factor", "table_rate_ratio"}
)
#: On a single axis a tilt of the gyro is only seen by the Earth's rate, as the effect of that rate.
ONE_AXIS_NOT = frozenset({"misalignment", "non_orthogonality", "cross_axis_nonlinearity"})

Sizes = dict[str, dict[str, float]]


@lru_cache(maxsize=1)
def _kept() -> dict[str, Sizes]:
    return dict(json.loads(FILE.read_text(encoding="utf-8"))["sizes"])


def sizes(name: str) -> Sizes:
    """Return effect -> z -> size of every effect that a protocol can show and its unit's technology can have."""
    technology = protocol(name).gyro.technology or ""
    absent = {effect for effect, kind in CATALOGUE.items() if kind.ranges.get(technology) == (0.0, 0.0)}
    return {effect: levels for effect, levels in _kept()[name].items() if effect not in absent}


def sizing_of(name: str) -> Sizing:
    """Return what works out sizes on a protocol."""
    p = protocol(name)
    return Sizing(p.plan, p.bench, p.gyro)


def sizes_of(sizing: Sizing, effect: str, default: float) -> dict[str, float]:
    """Return z -> size of one effect; levels that no size gives are left out.

    Most effects are proportional to their size: three simulations show this, and the other sizes follow in proportion.
    """
    at, share = sizing.z_of(effect, default)
    if share < MIN_VISIBLE or at <= 0:
        return {}
    factors = [min(z / at, FARTHEST) for z in (Z_LEVELS[0], Z_LEVELS[-1])]
    seen = {1.0: at} | {factor: sizing.z_of(effect, default * factor)[0] for factor in factors}
    if all(abs(found / (at * factor) - 1) < STRAIGHT for factor, found in seen.items()):
        return {f"{z:g}": float(f"{default * z / at:.5g}") for z in Z_LEVELS}
    found = {z: _factor(sizing, effect, default, z, seen) for z in Z_LEVELS}
    return {f"{z:g}": float(f"{default * factor:.5g}") for z, factor in found.items() if factor is not None}


def _factor(sizing: Sizing, effect: str, default: float, z: float, seen: dict[float, float]) -> float | None:
    """Return by how much a size must be multiplied for z, or None; what is simulated on the way is added to `seen`.

    Between two sizes by a straight line in logarithms and by their middle in turn: some effects stand still in between.
    """
    for attempt in range(ROUNDS):
        nearest = min(seen, key=lambda factor: abs(seen[factor] / z - 1))
        if abs(seen[nearest] / z - 1) < CLOSE:
            return nearest
        below = max((factor for factor, found in seen.items() if found < z), default=None)
        above = min((factor for factor, found in seen.items() if found > z), default=None)
        if above is None or below is None or below > above:
            guess = max(seen) * 3.0 if above is None else min(seen) / 3.0
        elif attempt % 2:
            guess = float(np.sqrt(below * above))
        else:
            share = np.log(z / max(seen[below], 1e-3)) / np.log(seen[above] / max(seen[below], 1e-3))
            guess = float(below * (above / below) ** np.clip(share, 0.05, 0.95))
        if not 1 / FARTHEST <= guess <= FARTHEST:
            return None
        seen[guess] = sizing.z_of(effect, default * guess)[0]
    return None


def drawn(name: str) -> dict[str, float]:
    """Return the usual size of every effect that may be hidden on a protocol, by its id."""
    one_axis = len(protocol(name).gyro.axes) == 1
    absent = NOT_DRAWN | (ONE_AXIS_NOT if one_axis else frozenset())
    return {effect: size for effect, size in sorted(hidden_defaults().items()) if effect not in absent}


def make(name: str, effects: Collection[str] = ()) -> Sizes:
    """Work out the sizes of some effects on one protocol; of all where none are named."""
    sizing = sizing_of(name)
    asked = {effect: default for effect, default in drawn(name).items() if not effects or effect in effects}
    made = {effect: sizes_of(sizing, effect, default) for effect, default in asked.items()}
    return {effect: by_z for effect, by_z in made.items() if len(by_z) == len(Z_LEVELS)}


def main(effects: Collection[str] = ()) -> None:
    """Work out sizes on every protocol, and keep them: of all effects, or anew those of the named ones."""
    unknown = set(effects) - set(hidden_defaults())
    if unknown:
        sys.exit(f"no effects: {', '.join(sorted(unknown))}; give some of {', '.join(sorted(hidden_defaults()))}")
    with ProcessPoolExecutor(max_workers=2) as pool:
        longest_first = sorted(PROTOCOLS, key=lambda name: -len(protocol(name).gyro.axes))
        made = dict(zip(longest_first, pool.map(partial(make, effects=effects), longest_first), strict=True))
    if effects:
        others = {name: {each: by_z for each, by_z in _kept()[name].items() if each not in effects} for name in made}
        made = {name: dict(sorted((others[name] | made[name]).items())) for name in made}
    document = {"made_by": COMMAND, "sizes": {name: made[name] for name in PROTOCOLS}}
    FILE.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    for name in PROTOCOLS:
        print(f"{name:3} {len(made[name])} effects")


if __name__ == "__main__":
    main(sys.argv[1:])
