"""`labctl effects`: the catalogue of effects and models."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json
from labctl.cli.output import console, print_json, table

if TYPE_CHECKING:
    from labctl.answers import CataloguedEffect


def effects(
    effect: Annotated[
        str | None,
        typer.Argument(metavar="EFFECT", help="Id of one effect: its equation, symbols and sources."),
    ] = None,
    as_json: Json = False,
    database: Database = None,  # noqa: ARG001
) -> None:
    """List the catalogue of physical effects and the model presets, or print one effect."""
    from labctl.services.effects import catalogue

    with one_clear_line():
        answer = catalogue(effect)
    if as_json:
        print_json(answer)
        return
    if effect is not None:
        _print_effect(answer.effects[0])
        return
    rows = table("effects", "id", "origin", "term", "what it is")
    for each in answer.effects:
        rows.add_row(each["id"], each["origin"], each["term"], each["sentence"])
    console.print(rows)
    presets = table("\nmodels", "name", "what it is")
    for preset in answer.models:
        presets.add_row(preset["name"], preset["sentence"])
    console.print(presets)


def _print_effect(effect: CataloguedEffect) -> None:
    console.print(f"{effect['term']}. {effect['sentence']}", highlight=False)
    if equation := effect["equation"]:
        console.print()
        for line in equation["text"].split("; "):
            console.print(f"    {line}", highlight=False, markup=False)
        rows = table("\nsymbols", "symbol", "unit", "name", "meaning")
        for symbol in equation["symbols"]:
            rows.add_row(symbol["symbol"].replace("[", "\\["), symbol["unit"], symbol["name"], symbol["meaning"])
        console.print(rows)
    parameters = table("\nshape", "parameter", "unit", "from", "to", "meaning")
    for each in effect["parameters"]:
        parameters.add_row(each["name"], each["unit"], f"{each['low']:g}", f"{each['high']:g}", each["meaning"])
    if effect["parameters"]:
        console.print(parameters)
    for source in effect["sources"]:
        gives = "the equation" if source["gives"] == "equation" else "the effect; the shape is labctl's own"
        console.print(f"\nSource of {gives}: {source['work']}; {source['place']}", highlight=False, markup=False)
