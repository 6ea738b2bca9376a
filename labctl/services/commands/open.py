"""Opening a database for a command: in this process, or through the service that holds it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from instruments.clock import SystemClock
from labctl.answers.campaigns import CampaignResponse
from labctl.config import default_database
from labctl.services.campaigns.resumability import with_resume
from labctl.services.campaigns.status import campaign_status
from labctl.services.commands.command import Command, CommandExecutor, LocalExecutor, RequestT, ResponseT
from labctl.services.commands.context import CommandContext
from labctl.services.drafts.answers import with_drafts
from labctl.services.read_access import open_readonly
from labctl.services.sufficiency.answers import with_target
from labctl.store import Store, holder_of, is_url, open_store

if TYPE_CHECKING:
    from labctl.services.commands.foreground_control import OpenTerminal
    from labctl.services.commands.remote import HttpExecutor


def service_url(database: str | None, campaign: int | None = None) -> str | None:
    """Return the address of the service that holds the database; None when no service does.

    A database to which several processes write has a service for each bench: here that of the campaign's bench.
    """
    location = database or default_database()
    if is_url(location):
        return None if campaign is None else _url_of_driver(location, campaign)
    holder = holder_of(location)
    return holder.url if holder is not None else None


def _url_of_driver(location: str, campaign: int) -> str | None:
    with open_readonly(location) as store:
        return _driver_url(store, store.campaigns.get(campaign).bench_name)


def _driver_url(store: Store, bench: str) -> str | None:
    from labctl.services.benches.lease import driver_of  # noqa: PLC0415  loads drivers

    driver = driver_of(store, bench, SystemClock().utc())
    return None if driver is None else driver.url


def diagnosis_service_url(database: str | None, serial: str, bench: str | None) -> str | None:
    """Return the address of the service that diagnoses a unit; None where this process does it.

    On a database to which several processes write it is the service of the diagnosis that has not ended, else of the
    bench that is named, else of the unit's last campaign. Raises BadInput, Conflict as a diagnosis does.
    """
    location = database or default_database()
    if not is_url(location):
        return service_url(location)
    from labctl.services.diagnosis.experiment_bench import bench_of_unit  # noqa: PLC0415  loads drivers
    from labctl.services.planning.loading import load_bench  # noqa: PLC0415  as above

    with open_readonly(location) as store:
        if (unfinished := store.diagnoses.open_of_unit(serial)) is not None:
            return _driver_url(store, unfinished.bench_name)
        return _driver_url(store, bench_of_unit(store, serial, None if bench is None else load_bench(bench)).name)


@contextmanager
def open_commands(database: str | None, open_terminal: OpenTerminal | None = None) -> Iterator[CommandExecutor]:
    """Give the executor of commands on a database: the service that holds it, or else this process.

    `open_terminal` opens the terminal of a campaign that runs in the foreground of this process.
    """
    location = database or default_database()
    if url := service_url(location):
        with _remote(url) as executor:
            yield executor
        return
    from labctl.services.commands.foreground_control import ForegroundControl, no_terminal  # noqa: PLC0415  loads drivers

    with ExitStack() as opened:

        def open_writable() -> Store:
            return opened.enter_context(open_store(location, write=True))

        control = ForegroundControl(location, open_terminal or no_terminal)
        local = LocalExecutor(CommandContext(open_writable, SystemClock(), control))
        yield _routed(local, location) if is_url(location) else local


def _routed(local: CommandExecutor, location: str) -> CommandExecutor:
    from labctl.service_connection import ServiceConnection  # noqa: PLC0415  an HTTP client only where one is needed
    from labctl.services.commands.remote import HttpExecutor  # noqa: PLC0415  as above
    from labctl.services.commands.routing import RoutedExecutor  # noqa: PLC0415  as above

    def remote(url: str) -> HttpExecutor:
        return HttpExecutor(ServiceConnection(url))

    return RoutedExecutor(local, remote, lambda: open_readonly(location), SystemClock())


@contextmanager
def _remote(url: str) -> Iterator[HttpExecutor]:
    """Give the executor of a service; an HTTP client is loaded only where one is needed."""
    from labctl.service_connection import ServiceConnection  # noqa: PLC0415
    from labctl.services.commands.remote import HttpExecutor  # noqa: PLC0415

    with ServiceConnection(url) as connection:
        yield HttpExecutor(connection)


class DatabaseCommands:
    """Executes commands on a database that is opened for each, as `execute` does."""

    def __init__(self, database: str | None) -> None:
        self._database = database

    def execute(self, command: Command[RequestT, ResponseT], request: RequestT) -> ResponseT:
        """Execute one command. Raises LabctlError."""
        return execute(self._database, command, request)


def execute(
    database: str | None,
    command: Command[RequestT, ResponseT],
    request: RequestT,
    open_terminal: OpenTerminal | None = None,
) -> ResponseT:
    """Execute one command on a database, as `open_commands` opens it. Raises LabctlError."""
    with open_commands(database, open_terminal) as commands:
        return commands.execute(command, request)


def current_status(database: str | None, campaign: int | None) -> CampaignResponse:
    """Return where a campaign is: live from the service that holds the database, else as the database tells.

    Without a number: the newest campaign. Raises NotFound.
    """
    with open_readonly(database) as store:
        answer = with_target(store, with_drafts(store, with_resume(store, campaign_status(store, campaign))))
    if url := service_url(database, answer.id):
        with _remote(url) as executor:
            return executor.fetch(f"/api/campaigns/{answer.id}", CampaignResponse)
    return answer


def campaign_to_resume(database: str | None, campaign: int | None) -> int | None:
    """Return the campaign that a resume without a number means.

    With a service the newest campaign; None without one: the newest that is unfinished, as the resume itself finds it.
    """
    if campaign is None and service_url(database) is not None:
        return current_status(database, None).id
    return campaign
