"""A building block of experiments: what it changes in a recipe, in words and as a function, and what it needs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from instruments.plugins import PluginGroup
from procedures.recipe.recipe import Recipe

#: Changes of a recipe, by key; None where the recipe does not lend itself to the experiment.
Changes = Mapping[str, object] | None
#: What an experiment does not take over from the recipe: it is no calibration.
NOT_TAKEN: Mapping[str, object] = {
    "fit": None, "verification": None, "profiles": (), "indexing": None, "inverted": None, "power_cycle": None,
    "ramp": None,
    "replicates": {}, "repeats": 1,
}  # fmt: skip


@dataclass(frozen=True)
class Block:
    """One building block."""

    id: str  #: small letters, digits and _
    text: str  #: what is done, in words, to go on with after "Next: "
    change: Callable[[Recipe], Changes]
    needs: tuple[str, ...] = ()  #: what a bench needs besides table and chamber, in words

    def changed(self, recipe: Recipe) -> Recipe | None:
        """Return the recipe of the experiment; None where this recipe does not lend itself to it.

        Raises ValueError where the changes make no recipe.
        """
        changes = None if recipe.turns is not None else self.change(recipe)
        if changes is None:
            return None
        return Recipe.model_validate({**recipe.model_dump(), **NOT_TAKEN, **changes})


def _checked(found: object) -> tuple[Block, ...]:
    blocks = tuple(found) if isinstance(found, Iterable) else (found,)
    for block in blocks:
        if not isinstance(block, Block):
            raise TypeError(f"{block!r} is not a Block; make one of procedures.experiments.block.Block")
    return tuple(block for block in blocks if isinstance(block, Block))


BLOCKS: PluginGroup[tuple[Block, ...]] = PluginGroup("labctl.experiments", "experiment", _checked)


def all_blocks() -> tuple[Block, ...]:
    """Return every installed block, labctl's own first."""
    return tuple(BLOCKS.merged(lambda blocks: ((block.id, block) for block in blocks), "experiment").values())
