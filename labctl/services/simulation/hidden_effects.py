"""Effects hidden in simulated units: read from `EFFECT` or `EFFECT=SIZE`."""

from __future__ import annotations

import math
import re

from instruments.bench_config import BenchFile, SimulationSettings
from instruments.simulation import hidden_defaults
from labctl.errors import BadInput


def is_in_noise_units(text: str) -> bool:
    """Return whether a size is given in noise units: `EFFECT=z10`."""
    return re.fullmatch(r"[^=]+=z\d+(\.\d+)?", text) is not None


def hidden_sizes(texts: list[str]) -> dict[str, float]:
    """Return effect id -> size in its coefficient unit; without a size, the simulator's default. Raises BadInput.

    Sizes in noise units hold for a plan: `effect_sizes.sizes_on_plan` reads them too.
    """
    known = hidden_defaults()
    sizes: dict[str, float] = {}
    for text in texts:
        name, _, size = text.partition("=")
        if name not in known:
            raise BadInput(f"effect {name!r} cannot be hidden; choose one of {', '.join(sorted(known))}")
        try:
            sizes[name] = float(size) if size else known[name]
            if not math.isfinite(sizes[name]):
                raise ValueError(size)
        except ValueError:
            raise BadInput(
                f"hide {text}: size {size!r} is not a finite number; give a number in the unit of the effect "
                "(`labctl effects`)"
            ) from None
    return sizes


def refuse_unless_simulated(bench: BenchFile, texts: list[str]) -> None:
    """Raise BadInput where effects are to be hidden in units that are not simulated in this process."""
    if not bench.is_simulated:
        raise BadInput(
            f"hide {', '.join(texts)}: bench {bench.name} is not simulated, and effects can be hidden only in "
            "simulated units; leave the key `hide` out"
        )


def with_hidden_effects(bench: BenchFile, texts: list[str]) -> BenchFile:
    """Return a simulated bench with effects hidden in its units, `EFFECT` or `EFFECT=SIZE`. Raises BadInput."""
    if not texts:
        return bench
    refuse_unless_simulated(bench, texts)
    simulation = bench.simulation or SimulationSettings()
    hidden = {**simulation.hidden, **hidden_sizes(texts)}
    return bench.model_copy(update={"simulation": simulation.model_copy(update={"hidden": hidden})})
