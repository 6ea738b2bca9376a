"""The commands of acts on a campaign, made from what each act states of its command and from its request."""

from __future__ import annotations

import getpass
import inspect
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import BenchName, Database, Json, SimulatedSpeed, WireLogOnly
from labctl.cli.output import print_json
from labctl.cli.printing.campaigns import print_campaign, print_end

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo
    from typer._click.core import Command, Context

    from labctl.answers.campaigns import CampaignResponse
    from labctl.services.commands.acts.campaign_act import AddressedT, CampaignAct
    from labctl.services.commands.acts.campaign_command import CampaignCommand, CommandOption, DefaultCampaign

Id = Annotated[int, typer.Argument(metavar="ID", help="Number of the campaign.")]
By = Annotated[
    str | None, typer.Option("--by", metavar="NAME", help="Name of the person; default: the user who is logged in.")
]
Reason = Annotated[str, typer.Option("--reason", metavar="TEXT", help="Reason for this action; it is recorded.")]
#: Options that several commands have in the same words.
_SHARED: dict[str, Any] = {
    "reason": Reason, "by": By, "bench": BenchName, "speed": SimulatedSpeed, "wire_log": WireLogOnly,
}  # fmt: skip


def person(by: object) -> str:
    """Return who acts: the given name, or else the user who is logged in."""
    if isinstance(by, str) and by:
        return by
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return "a person"


class CampaignGroup(TyperGroup):
    """`labctl campaign`: its own commands, and those of acts, which are only read where an own one does not answer.

    The declarations of acts load the services, which no other command has to wait for.
    """

    def list_commands(self, ctx: Context) -> list[str]:
        """Return the names of all commands, in the order of the help."""
        names = super().list_commands(ctx)
        for act, line in _declared():
            names.insert(names.index(line.before), act.name)
        return names

    def get_command(self, ctx: Context, cmd_name: str) -> Command | None:
        """Return a command by its name; None: there is none."""
        written = super().get_command(ctx, cmd_name)
        return written or next((command_of(act, line) for act, line in _declared() if act.name == cmd_name), None)


def _declared() -> list[tuple[CampaignAct[Any], CampaignCommand]]:
    """Return each act whose command is not written by hand, and what it states of the command."""
    from labctl.services.commands.acts import catalogue

    return [(act, act.command_line) for act in catalogue.CAMPAIGN_ACTS if act.command_line is not None]


@cache
def command_of(act: CampaignAct[AddressedT], line: CampaignCommand) -> TyperCommand:
    """Return the command of an act: the campaign, the options that it states, --json and --database."""

    def perform(campaign: int | None, as_json: bool, database: str | None, **options: object) -> None:
        with one_clear_line():
            number = _campaign(line.default_campaign, database, campaign)
            answer = _send(act, line, number, options, database, quiet=as_json)
        if line.runs_here:
            print_end(answer, as_json=as_json)
        else:
            print_json(answer) if as_json else print_campaign(answer)

    parameters = [
        *_options(act, line),
        _parameter("as_json", Json, False),
        _parameter("database", Database, None),
    ]
    perform.__name__, perform.__doc__ = act.name, line.help
    perform.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]  # what typer reads
    perform.__annotations__ = {each.name: each.annotation for each in parameters}
    alone = typer.Typer(add_completion=False, rich_markup_mode="rich")
    alone.command(act.name)(perform)
    made = get_command(alone)
    assert isinstance(made, TyperCommand)
    return made


def _campaign(default: DefaultCampaign, database: str | None, campaign: int | None) -> int | None:
    """Return the number of the campaign that is meant. Raises NotFound."""
    from labctl.services.commands.open import campaign_to_resume, current_status

    if default == "resumable":
        return campaign_to_resume(database, campaign)
    return campaign if campaign is not None or default == "none" else current_status(database, None).id


def _send(
    act: CampaignAct[AddressedT],
    line: CampaignCommand,
    campaign: int | None,
    options: Mapping[str, object],
    database: str | None,
    *,
    quiet: bool,
) -> CampaignResponse:
    """Have an act carried out: what the options give is a field of its request, or else of the address."""
    from labctl.services.commands.open import execute

    named = {**options, "by": person(options["by"])} if "by" in options else options
    values = line.request(named)
    body = act.body.model_validate({name: value for name, value in values.items() if name in act.body.model_fields})
    address = {name: value for name, value in values.items() if name not in act.body.model_fields}
    terminal = None
    if line.runs_here:
        from labctl.cli.campaign_terminal import campaign_terminal

        terminal = campaign_terminal(quiet=quiet)
    return execute(database, act.command, act.request_type(campaign, body, **address), terminal)


def _options(act: CampaignAct[AddressedT], line: CampaignCommand) -> list[inspect.Parameter]:
    """Return the parameters of a command for its campaign and its options, in the order of the help."""
    fields = act.body.model_fields
    options = [
        _of_name(option, fields.get(option), line.defaults) if isinstance(option, str) else _of_words(option)
        for option in line.options or tuple(fields)
    ]
    has_campaign = any(each.name == "campaign" for each in options)
    return options if has_campaign else [_parameter("campaign", Id), *options]


def _of_words(option: CommandOption) -> inspect.Parameter:
    """Return the parameter of an option with words of its own."""
    kind = (
        typer.Argument(metavar=option.metavar, help=option.help)
        if option.is_argument
        else typer.Option(_flag(option.name), metavar=option.metavar, help=option.help)
    )
    default = inspect.Parameter.empty if option.default is ... else option.default
    return _parameter(option.name, Annotated[option.kind, kind], default)


def _of_name(name: str, field: FieldInfo | None, defaults: Mapping[str, object]) -> inspect.Parameter:
    """Return the parameter of a field of the request, or of an option that several commands have.

    What the act states comes before the default of the request.
    """
    kind = _SHARED.get(name)
    if kind is None:
        assert field is not None, f"option {name}: neither a field of the request nor an option of several commands"
        kind = Annotated[field.annotation, typer.Option(_flag(name), help=field.description)]
    default = None if field is None or name == "by" else field.get_default()  # by: the user who is logged in
    required = field is not None and field.is_required() and name != "by"
    return _parameter(name, kind, defaults.get(name, inspect.Parameter.empty if required else default))


def _flag(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _parameter(name: str, kind: Any, default: object = inspect.Parameter.empty) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=kind, default=default)
