"""A command: one request, one response, its place in the HTTP API, and the handler that executes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Generic, Literal, Protocol, TypeVar

from labctl.answers.base import ResponseModel
from labctl.services.commands.context import CommandContext
from labctl.services.commands.encoding import json_body

RequestT = TypeVar("RequestT")
ResponseT = TypeVar("ResponseT", bound=ResponseModel)
Handler = Callable[[CommandContext, RequestT], ResponseT]


class NoContent(ResponseModel):
    """The response of a command that answers nothing (HTTP 204)."""


@dataclass(frozen=True)
class Newest:
    """How an HTTP client finds a path parameter that a request leaves open: the first entry of a list, newest first."""

    parameter: str
    path: str
    key: str
    otherwise: int  #: where the list is empty


@dataclass(frozen=True, kw_only=True)
class Command(Generic[RequestT, ResponseT]):
    """A change of the database. `responses` maps each HTTP status of success to its response; the first is usual."""

    method: Literal["POST", "DELETE"]
    path: str
    handler: Handler[RequestT, ResponseT]
    responses: Mapping[int, type[ResponseT]]
    encode: Callable[[ExitStack, RequestT], Mapping[str, object]] = json_body  #: keyword arguments of an httpx request
    newest: Newest | None = None
    computes: bool = False  #: takes long: a service has it done by its computation; the handler is a module's function

    @property
    def status(self) -> int:
        """The usual HTTP status of success."""
        return next(iter(self.responses))

    def status_of(self, response: ResponseModel) -> int:
        """Return the HTTP status that goes with a response."""
        return next(status for status, kind in self.responses.items() if isinstance(response, kind))


class CommandExecutor(Protocol):
    """Executes commands: in this process, or by asking the service that holds the database."""

    def execute(self, command: Command[RequestT, ResponseT], request: RequestT) -> ResponseT:
        """Execute a command. Raises LabctlError."""
        ...


class LocalExecutor:
    """Executes commands in this process."""

    def __init__(self, context: CommandContext) -> None:
        self._context = context

    def execute(self, command: Command[RequestT, ResponseT], request: RequestT) -> ResponseT:
        """Execute a command with this process's store, clock and control over campaigns."""
        return command.handler(self._context, request)
