"""A stored recipe as a recipe file."""

from __future__ import annotations

from collections.abc import Mapping

import tomli_w
from pydantic import ValidationError

from procedures.recipe.recipe import Recipe, recipe_document


def recipe_text(recipe: Mapping[str, object]) -> str:
    """Return a stored recipe as a recipe file; nothing for one of a release of labctl whose recipes had other keys."""
    try:
        return tomli_w.dumps(recipe_document(Recipe.model_validate(dict(recipe))))
    except ValidationError:
        return ""
