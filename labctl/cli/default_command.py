"""A group of commands of which one is meant where none is named: `labctl certificates SERIAL` is `... list SERIAL`."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from typer.core import TyperGroup

if TYPE_CHECKING:
    from typer._click.core import Context


class GroupWithList(TyperGroup):
    """Takes `list` where the first word is none of its commands."""

    DEFAULT: ClassVar[str] = "list"

    def parse_args(self, ctx: Context, args: list[str]) -> list[str]:
        """Put the default before arguments that name no command."""
        if args and args[0] not in (*self.commands, *ctx.help_option_names):
            args = [self.DEFAULT, *args]
        return super().parse_args(ctx, args)
