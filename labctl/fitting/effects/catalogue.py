"""The catalogue of effects, by id: labctl's own, then those of other distributions (`families`).

An entry point of the group `labctl.effects` is one class of effect, or several in a row; labctl's own is `EFFECTS`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, lru_cache
from typing import TYPE_CHECKING

from labctl.errors import BadInput
from labctl.fitting.effects import (
    acceleration,
    alignment,
    bias,
    environment,
    history,
    nonlinearity,
    rate_table,
    response,
    scale_factor,
    thermal,
)
from labctl.fitting.effects.base import Effect, Term

if TYPE_CHECKING:
    from labctl.answers.effects import EffectJson

_OWN = (
    bias,
    scale_factor,
    alignment,
    nonlinearity,
    acceleration,
    rate_table,
    thermal,
    history,
    response,
    environment,
)
#: labctl's own entry point: a family lists its effects in its EFFECTS.
EFFECTS: tuple[type[Effect], ...] = tuple(kind for family in _OWN for kind in family.EFFECTS)


class Catalogue(Mapping[str, Effect]):
    """Installed effects by id. labctl's own are imported at first use, those of others when one is asked for."""

    def __getitem__(self, effect_id: str) -> Effect:
        own_effect = _own().get(effect_id)
        return _all()[effect_id] if own_effect is None else own_effect

    def __iter__(self) -> Iterator[str]:
        return iter(_all())

    def __len__(self) -> int:
        return len(_all())


@cache
def _own() -> dict[str, Effect]:
    """Return labctl's own effects; a robot's program needs no others, nor the metadata of what is installed."""
    return {own.id: own for own in (kind() for kind in EFFECTS)}


@cache
def _all() -> dict[str, Effect]:
    from labctl.fitting.effects.families import FAMILIES  # noqa: PLC0415  only where others' effects count

    return FAMILIES.merged(lambda kinds: ((kind.id, kind) for kind in kinds), "effect")


CATALOGUE: Mapping[str, Effect] = Catalogue()


def effect(effect_id: str) -> Effect:
    """Return an effect of the catalogue; raises BadInput naming the nearest ids."""
    if effect_id in CATALOGUE:
        return CATALOGUE[effect_id]
    from difflib import get_close_matches  # noqa: PLC0415  for a mistake only

    near = get_close_matches(effect_id, CATALOGUE, n=3, cutoff=0.4)
    hint = (
        f"did you mean {' or '.join(near)}?"
        if near
        else ("`labctl effects` lists them, and a package may bring it (group labctl.effects)")
    )
    raise BadInput(f"effect {effect_id!r} is not in the catalogue; {hint}")


@lru_cache(maxsize=256)
def _formula(name: str, text: str) -> Effect:
    """Return a formula; a fit asks for that of a term some hundred times, and to read it takes 0.3 ms."""
    from labctl.fitting.effects.formula import Formula  # noqa: PLC0415  few models have one

    return Formula(name, text)


def kind_of(term: Term) -> Effect:
    """Return the effect of a term: of the catalogue, or the formula that it carries."""
    return _formula(term.effect, term.formula) if term.formula else effect(term.effect)


def parse_term(text: str) -> Term:
    """Read `name`, `name:order` or, with a stated shape, `name@parameter=value@parameter=value`.

    Raises BadInput for an effect without such an order or parameter, and for a value outside the parameter's range.
    """
    head, *stated = text.split("@")
    term = _ordered(head)
    return replace(term, parameters=_stated(effect(term.effect), stated)) if stated else term


def _stated(kind: Effect, texts: Sequence[str]) -> dict[str, float]:
    """Return parameters of an effect from texts `name=value`: all that it has."""
    parameters = {parameter.name: parameter for parameter in kind.parameters}
    values: dict[str, float] = {}
    for text in texts:
        name, _, value_text = (part.strip() for part in text.partition("="))
        if name not in parameters:
            advice = f"give one of {', '.join(parameters)}" if parameters else "write it without '@'"
            raise BadInput(f"effect {kind.id!r} has no parameter {name!r}; {advice}")
        parameter = parameters[name]
        try:
            value = float(value_text)
        except ValueError:
            value = float("nan")
        if not parameter.low <= value <= parameter.high:
            raise BadInput(
                f"effect {kind.id!r}: {name} = {value_text!r} is not a number from {parameter.low:g} to "
                f"{parameter.high:g} {parameter.unit}; give one in that range"
            )
        values[name] = value
    needed = [parameter.name for parameter in kind.parameters if parameter.symbol and not parameter.optional]
    if missing := [name for name in needed if name not in values]:
        raise BadInput(f"effect {kind.id!r}: the value of {missing[0]} is missing; give all of {', '.join(needed)}")
    return values


def _ordered(text: str) -> Term:
    name, _, order_text = text.partition(":")
    kind = effect(name.strip())
    if not order_text:
        return Term(kind.id)
    if kind.max_order is None:
        raise BadInput(f"effect {kind.id!r} has no polynomial order; write it without ':{order_text}'")
    if not order_text.strip().isdigit() or not kind.min_order <= int(order_text) <= kind.max_order:
        raise BadInput(
            f"effect {kind.id!r}: order {order_text!r} is not a whole number; give one from {kind.min_order} to "
            f"{kind.max_order}"
        )
    return Term(kind.id, int(order_text))


def describe_effects() -> list[EffectJson]:
    """Return the catalogue as JSON, one record per effect."""
    from labctl.fitting.effects.description import (  # noqa: PLC0415  draws MathML, which a robot's program does not
        equation_of,
        parameters_of,
        sources_of,
    )

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
            "parameters": parameters_of(kind),
            "equation": equation_of(kind),
            "sources": sources_of(kind),
            "plausible": {technology: list(span) for technology, span in kind.ranges.items()},
            "aliases": list(kind.aliases),
            "experiment": kind.experiment,
            "draws": list(kind.draws),
        }
        for kind in CATALOGUE.values()
    ]
