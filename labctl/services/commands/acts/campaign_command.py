"""What an act states of its command, `labctl campaign NAME`: data, from which the command line makes the command."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

#: The values of the options, by name; of the fields of a request likewise.
Values = Mapping[str, object]
#: Which campaign is meant where no number is given: the newest, or the newest that can be resumed.
DefaultCampaign = Literal["none", "newest", "resumable"]


@dataclass(frozen=True, kw_only=True)
class CommandOption:
    """An option, or an argument, with words of its own."""

    name: str  #: of its value
    kind: object  #: type of the value
    help: str
    metavar: str | None = None  #: None: that of its type
    is_argument: bool = False
    default: object = ...  #: ...: it has to be given


@dataclass(frozen=True, kw_only=True, eq=False)
class CampaignCommand:
    """The command of an act. What it does not state follows from the request of the act."""

    help: str
    #: In the order of the help. A text names a field of the request, or an option that other commands have too.
    options: tuple[str | CommandOption, ...] = ()  #: empty: one for each field of the request
    defaults: Values = field(default_factory=dict)  #: by option, on the command line only
    default_campaign: DefaultCampaign = "none"  #: none: the number has to be given
    request: Callable[[Values], Values] = dict  #: the fields of the request, and of its address, from the options
    runs_here: bool = False  #: without a service the campaign runs in the terminal until it ends; exit 1 if it failed
    before: str = "abort"  #: the command before which it stands in the help
