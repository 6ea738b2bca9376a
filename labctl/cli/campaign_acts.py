"""The commands of acts on a campaign, made from what each act says of itself and from the fields of its request."""

from __future__ import annotations

import getpass
import inspect
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any

import typer
from pydantic.fields import FieldInfo
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json
from labctl.cli.output import print_json
from labctl.cli.printing.campaigns import print_campaign

if TYPE_CHECKING:
    from typer._click.core import Command, Context

    from labctl.services.commands.acts.campaign_act import BodyT, CampaignAct

Id = Annotated[int, typer.Argument(metavar="ID", help="Number of the campaign.")]
By = Annotated[
    str | None, typer.Option("--by", metavar="NAME", help="Name of the person; default: the user who is logged in.")
]
Reason = Annotated[str, typer.Option("--reason", metavar="TEXT", help="Reason for this action; it is recorded.")]
#: Fields of requests that have an option with words of its own; that of another field has the field's description.
_OPTIONS: dict[str, Any] = {"reason": Reason, "by": By}
#: The commands of acts stand before this one.
NEXT = "resume"


def person(by: str | None) -> str:
    """Return who acts: the given name, or else the user who is logged in."""
    try:
        return by or getpass.getuser()
    except (KeyError, OSError):
        return "a person"


class CampaignGroup(TyperGroup):
    """`labctl campaign`: its own commands, and those of acts, which are only read where an own one does not answer.

    The declarations of acts load the services, which no other command has to wait for.
    """

    def list_commands(self, ctx: Context) -> list[str]:
        """Return the names of all commands, in the order of the help."""
        own = super().list_commands(ctx)
        place = own.index(NEXT) if NEXT in own else len(own)
        return [*own[:place], *(name for name in _made() if name not in own), *own[place:]]

    def get_command(self, ctx: Context, cmd_name: str) -> Command | None:
        """Return a command by its name; None: there is none."""
        return super().get_command(ctx, cmd_name) or _made().get(cmd_name)


def _made() -> dict[str, TyperCommand]:
    """Return the command of each act that is not written by hand, by name."""
    from labctl.services.commands.acts import catalogue

    return {act.name: command_of(act) for act in catalogue.CAMPAIGN_ACTS if act.command_help}


@cache
def command_of(act: CampaignAct[BodyT]) -> TyperCommand:
    """Return the command of an act: the campaign, an option for each field of the request, --json and --database."""

    def perform(campaign: int, as_json: bool, database: str | None, **given: object) -> None:
        from labctl.services.commands.open import execute
        from labctl.services.commands.requests import ToCampaign

        with one_clear_line():
            if "by" in given:
                by = given["by"]
                given["by"] = person(by if isinstance(by, str) else None)
            answer = execute(database, act.command, ToCampaign(campaign, act.body.model_validate(given)))
        print_json(answer) if as_json else print_campaign(answer)

    parameters = [
        _parameter("campaign", Id),
        *(_option(act, name, field) for name, field in act.body.model_fields.items()),
        _parameter("as_json", Json, False),
        _parameter("database", Database, None),
    ]
    perform.__name__, perform.__doc__ = act.name, act.command_help
    perform.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]  # what typer reads
    perform.__annotations__ = {each.name: each.annotation for each in parameters}
    alone = typer.Typer(add_completion=False, rich_markup_mode="rich")
    alone.command(act.name)(perform)
    made = get_command(alone)
    assert isinstance(made, TyperCommand)
    return made


def _option(act: CampaignAct[BodyT], name: str, field: FieldInfo) -> inspect.Parameter:
    """Return the option of a field; what the act states comes before the default of the request."""
    kind = _OPTIONS.get(name)
    if kind is None:
        kind = Annotated[field.annotation, typer.Option(f"--{name.replace('_', '-')}", help=field.description)]
    default = inspect.Parameter.empty if field.is_required() else field.get_default()
    if name == "by":
        default = None  # the user who is logged in
    return _parameter(name, kind, act.command_defaults.get(name, default))


def _parameter(name: str, kind: Any, default: object = inspect.Parameter.empty) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=kind, default=default)
