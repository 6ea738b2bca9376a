"""`labctl effects`: the catalogue of effects and models."""

from __future__ import annotations

from labctl.cli.options import Database, Json
from labctl.cli.output import console, print_json, table


def effects(as_json: Json = False, database: Database = None) -> None:  # noqa: ARG001
    """List the catalogue of physical effects and the model presets."""
    from labctl.services.effects import catalogue

    answer = catalogue()
    if as_json:
        print_json(answer)
        return
    rows = table("effects", "id", "origin", "term", "what it is")
    for effect in answer.effects:
        rows.add_row(effect["id"], effect["origin"], effect["term"], effect["sentence"])
    console.print(rows)
    presets = table("\nmodels", "name", "what it is")
    for preset in answer.models:
        presets.add_row(preset["name"], preset["sentence"])
    console.print(presets)
