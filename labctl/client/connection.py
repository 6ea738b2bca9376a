"""What the parts of the client share: one connection to a service, and how a request becomes an answer."""

from __future__ import annotations

from typing import TypeVar
from urllib.parse import quote

import httpx
from pydantic import BaseModel

from instruments.clock import Clock
from labctl.answers.base import Request
from labctl.service_connection import ServiceConnection, json_of

ModelT = TypeVar("ModelT", bound=BaseModel)


class ClientPart:
    """Methods of one kind, on a connection that all parts share."""

    _connection: ServiceConnection
    _clock: Clock

    def _post(self, path: str, request: Request) -> httpx.Response:
        return self._connection.request("POST", path, json=request.model_dump(mode="json", exclude_unset=True))

    def _ask(self, path: str, request: Request, kind: type[ModelT]) -> ModelT:
        return kind.model_validate(json_of(self._post(path, request)))


def part(serial: str) -> str:
    """Return a serial number as one part of a path."""
    return quote(serial, safe="")
