"""Models of [fit] and [stop] in a recipe, checked before it begins: a wrong name is no reason to lose a night."""

from __future__ import annotations

from labctl.errors import BadInput
from procedures.recipe.recipe import Recipe


def check_fit(recipe: Recipe) -> None:
    """Raise BadInput for a model or an effect in a recipe's [fit] or [stop] that labctl does not have."""
    models: list[tuple[str, str | None, list[str]]] = []
    if (stop := recipe.stop) is not None:
        models.append(("stop", stop.model, list(stop.effects)))
    if (rules := recipe.fit) is not None:
        models += [("fit", rules.model, list(rules.effects)), *(("fit", name, []) for name in rules.compare)]
    if not models:
        return
    from labctl.fitting.models.presets import preset_for  # noqa: PLC0415  it loads the libraries of the fit

    for table, model, effects in models:
        try:
            preset_for(model, effects)
        except BadInput as error:
            raise BadInput(f"recipe {recipe.name}: [{table}]: {error}; correct the recipe") from error
