"""Sections of a designed recipe that an effect of the model needs, and that no scheme of rates and temperatures has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from instruments.bench_config import BenchFile
from labctl.errors import BadInput
from procedures.experiments import SUPPLY_PCT
from procedures.recipe.recipe import Recipe
from procedures.recipe.schemes import Span, handling_c

#: The effect of the supply voltage, and the one that a second distance from the table's axis tells from a nonlinearity.
OF_SUPPLY, OF_RADIUS = "supply_sensitivity", "centripetal_acceleration"


def further_sections(
    effects: Sequence[str], base: Recipe, span: Span, bench: BenchFile
) -> Mapping[str, object]:  # fmt: skip
    """Return the sections by name: steps of the supply, and another radius, where bench and model have them.

    Raises BadInput for an effect of the supply on a bench without one.
    """
    named = {effect.partition(":")[0] for effect in effects}
    rates = [-span.rate_dps, 0.0, span.rate_dps]
    sections: dict[str, object] = {}
    if OF_SUPPLY in named:
        if bench.supply is None:
            raise BadInput(
                f"effect {OF_SUPPLY}: bench {bench.name} cannot change the supply voltage of the units; name a bench "
                "file with a [supply], or leave the effect out"
            )
        sections["supply"] = {"deviations_pct": SUPPLY_PCT, "rates_dps": rates}
    if OF_RADIUS in named and bench.eccentricity is not None and bench.eccentricity.other_radii_m:
        sections["another_radius"] = {"temperatures_c": [handling_c(base, span)], "rates_dps": rates}
    return sections
