"""Commands sent over HTTP to the service that holds the database."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TypeVar
from urllib.parse import quote

from labctl.answers.base import ResponseModel
from labctl.errors import Conflict
from labctl.service_connection import ServiceConnection, json_of
from labctl.services.commands.command import Command, RequestT, ResponseT
from labctl.services.commands.requests import Addressed

FetchedT = TypeVar("FetchedT", bound=ResponseModel)


class HttpExecutor:
    """Executes every command as a request to a service: method, path and body come from the command."""

    def __init__(self, connection: ServiceConnection) -> None:
        self._connection = connection

    def execute(self, command: Command[RequestT, ResponseT], request: RequestT) -> ResponseT:
        """Ask the service to execute a command. Raises ServiceRefused, Conflict, StoreError."""
        address = self._address(command, request)
        path = command.path.format(**{name: quote(str(value), safe="") for name, value in address.items()})
        with ExitStack() as opened:
            response = self._connection.request(command.method, path, **command.encode(opened, request))
        return command.responses[response.status_code].model_validate(json_of(response))

    def fetch(self, path: str, kind: type[FetchedT]) -> FetchedT:
        """Return what the service answers to a GET of `path`."""
        return self._connection.get(path, kind)

    def _address(self, command: Command[RequestT, ResponseT], request: RequestT) -> dict[str, object]:
        if not isinstance(request, Addressed):
            return {}
        address = request.address()
        for name in request.local_only:
            if address[name] is not None:
                raise Conflict(
                    f"--{name.replace('_', '-')} {address[name]}: the service at {self._connection.url} holds this "
                    "database and runs campaigns on its own bench at its own speed and date; leave the option out, "
                    "stop the service, or name another --database"
                )
        newest = command.newest
        if newest is not None and address[newest.parameter] is None:
            known = {name: quote(str(value), safe="") for name, value in address.items()}
            rows = json_of(self._connection.request("GET", newest.path.format(**known)))
            address[newest.parameter] = rows[0][newest.key] if rows else newest.otherwise
        return address
