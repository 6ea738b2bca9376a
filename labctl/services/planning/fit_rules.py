"""The [fit] of a recipe, checked before a campaign begins: a name that is not known is no reason to lose a night."""

from __future__ import annotations

from labctl.errors import BadInput
from procedures.recipe.recipe import Recipe


def check_fit(recipe: Recipe) -> None:
    """Raise BadInput for a model or an effect in a recipe's [fit] that labctl does not have."""
    if (rules := recipe.fit) is None:
        return
    from labctl.fitting.models.presets import preset_for  # noqa: PLC0415  it loads the libraries of the fit

    models = [(rules.model, list(rules.effects)), *((name, []) for name in rules.compare)]
    for model, effects in models:
        try:
            preset_for(model, effects)
        except BadInput as error:
            raise BadInput(f"recipe {recipe.name}: [fit]: {error}; correct the recipe") from error
