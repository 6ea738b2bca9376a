"""The catalogue of effects, by id; a family registers its effects in its own EFFECTS."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from types import MappingProxyType

from labctl.errors import BadInput
from labctl.fitting.effects import (
    acceleration,
    alignment,
    bias,
    environment,
    history,
    nonlinearity,
    rate_table,
    scale_factor,
    surface,
    thermal,
)
from labctl.fitting.effects.base import Effect, Term
from labctl.fitting.effects.formula import Formula
from labctl.json_types.effects import EffectJson

FAMILIES = (
    bias,
    scale_factor,
    surface,
    alignment,
    nonlinearity,
    acceleration,
    rate_table,
    thermal,
    history,
    environment,
)

CATALOGUE: Mapping[str, Effect] = MappingProxyType({kind.id: kind() for family in FAMILIES for kind in family.EFFECTS})


def effect(effect_id: str) -> Effect:
    """Return an effect of the catalogue; raises BadInput naming the nearest ids."""
    if effect_id in CATALOGUE:
        return CATALOGUE[effect_id]
    near = difflib.get_close_matches(effect_id, CATALOGUE, n=3, cutoff=0.4)
    hint = f"did you mean {' or '.join(near)}?" if near else "`labctl effects` lists them"
    raise BadInput(f"effect {effect_id!r} is not in the catalogue; {hint}")


def kind_of(term: Term) -> Effect:
    """Return the effect of a term: of the catalogue, or the formula that it carries."""
    return Formula(term.effect, term.formula) if term.formula else effect(term.effect)


def parse_term(text: str) -> Term:
    """Read `name` or `name:order`; raises BadInput when the effect has no such order."""
    name, _, order_text = text.partition(":")
    found = effect(name.strip())
    if not order_text:
        return Term(found.id)
    if found.max_order is None:
        raise BadInput(f"effect {found.id!r} has no polynomial order; write it without ':{order_text}'")
    if not order_text.strip().isdigit() or not found.min_order <= int(order_text) <= found.max_order:
        raise BadInput(
            f"effect {found.id!r}: order {order_text!r} is not a whole number "
            f"from {found.min_order} to {found.max_order}"
        )
    return Term(found.id, int(order_text))


def describe_effects() -> list[EffectJson]:
    """Return the catalogue as JSON, one record per effect."""
    return [
        {
            "id": kind.id,
            "term": kind.term,
            "sentence": kind.sentence,
            "origin": kind.origin,
            "rows": kind.rows,
            "needs": list(kind.needs),
            "order": kind.default_order,
            "max_order": kind.max_order,
            "parameters": [{"name": p.name, "unit": p.unit, "low": p.low, "high": p.high} for p in kind.parameters],
            "plausible": {technology: list(span) for technology, span in kind.ranges.items()},
            "aliases": list(kind.aliases),
            "experiment": kind.experiment,
            "draws": list(kind.draws),
        }
        for kind in CATALOGUE.values()
    ]
