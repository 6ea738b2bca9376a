"""Commands sent over HTTP to the service that holds the database."""

from __future__ import annotations

from contextlib import ExitStack
from typing import Any, TypeVar
from urllib.parse import quote

import httpx

from labctl.config import KEY_VARIABLE, key, os_user
from labctl.errors import Conflict, LabctlError, NotCertified, StoreError
from labctl.services.commands.command import Command, RequestT, ResponseT
from labctl.services.commands.requests import Addressed
from labctl.services.schemas.base import ResponseModel

TIMEOUT_S = 300.0
#: Header in which a command without a key names its user.
USER_HEADER = "Labctl-User"

FetchedT = TypeVar("FetchedT", bound=ResponseModel)


class ServiceRefused(LabctlError):
    """The service refused the command; the text is its own."""


class HttpExecutor:
    """Executes every command as a request to a service: method, path and body come from the command."""

    def __init__(self, url: str) -> None:
        shown = key()
        # without a key, the name only says who claims to ask; a service that wants a key does not read it
        identity = {"Authorization": f"Bearer {shown}"} if shown else {USER_HEADER: quote(os_user())}
        # the service that holds the database is near: a proxy is neither asked nor told a key
        self._client = httpx.Client(base_url=url, timeout=TIMEOUT_S, headers=identity, trust_env=False)

    def execute(self, command: Command[RequestT, ResponseT], request: RequestT) -> ResponseT:
        """Ask the service to execute a command. Raises ServiceRefused, Conflict, StoreError."""
        address = self._address(command, request)
        path = command.path.format(**{name: quote(str(value), safe="") for name, value in address.items()})
        with ExitStack() as opened:
            response = self._request(command.method, path, **command.encode(opened, request))
        return command.responses[response.status_code].model_validate(_content(response))

    def fetch(self, path: str, kind: type[FetchedT]) -> FetchedT:
        """Return what the service answers to a GET of `path`."""
        return kind.model_validate(_content(self._request("GET", path)))

    def _address(self, command: Command[RequestT, ResponseT], request: RequestT) -> dict[str, object]:
        if not isinstance(request, Addressed):
            return {}
        address = request.address()
        for name in request.local_only:
            if address[name] is not None:
                raise Conflict(
                    f"--{name} {address[name]}: the service at {self._client.base_url} holds this database and runs "
                    "campaigns on its own bench at its own pace; leave the option out, stop it, or name another "
                    "--database"
                )
        newest = command.newest
        if newest is not None and address[newest.parameter] is None:
            known = {name: quote(str(value), safe="") for name, value in address.items()}
            rows = _content(self._request("GET", newest.path.format(**known)))
            address[newest.parameter] = rows[0][newest.key] if rows else newest.otherwise
        return address

    def _request(self, method: str, path: str, **content: Any) -> httpx.Response:
        try:
            response = self._client.request(method, path, **content)
        except httpx.HTTPError as error:
            raise StoreError(
                f"the service at {self._client.base_url} holds the database but does not answer ({error}); "
                "look at it, or stop it"
            ) from error
        if response.is_error:
            body = _content(response)
            hint = f" (the command line sends the key in ${KEY_VARIABLE})" if response.status_code == 401 else ""
            refused = ServiceRefused(body.get("detail", response.text) + hint)
            refused.exit_status = NotCertified.exit_status if body.get("type", "").endswith(NotCertified.slug) else 2
            raise refused
        return response


def _content(response: httpx.Response) -> Any:
    return response.json() if response.content else {}
