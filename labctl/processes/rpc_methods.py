"""The methods of remote procedure calls: a call is a document of two lines, its head and its arguments in their order.

Here are the methods that a supervisor calls, which loads little; all others are in `bench_methods`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_type_hints

from pydantic import BaseModel, ConfigDict

from labctl.acting_user import Actor, actor
from labctl.errors import BadInput
from labctl.log.context import request_id
from labctl.processes.documents import Form
from labctl.processes.settings import BenchSettings


class _Head(BaseModel):
    """The first line of a call."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    call: str
    actor: Actor
    request_id: str = ""  #: the HTTP request that asks, for the log


@dataclass(frozen=True)
class Call:
    """What is asked, and in whose name."""

    name: str
    arguments: Mapping[str, object]
    actor: Actor
    request_id: str


_HEAD: Form[_Head] = Form(_Head, "the head of a call")


class RpcMethod:
    """A method that another process may call: its name and the types of its arguments and result."""

    def __init__(self, name: str, parameters: Sequence[inspect.Parameter], result: Any) -> None:
        """The annotations of `parameters` are types, not their names."""
        self.name = name
        self._signature = inspect.Signature(parameters)
        kinds = tuple(each.annotation for each in parameters)
        self._arguments: Form[Any] = Form(tuple.__class_getitem__(kinds), f"what call {name} was given")
        self.result: Form[Any] = Form(result, f"the answer to call {name}")

    @classmethod
    def of_method(cls, name: str, method: Callable[..., object]) -> RpcMethod:
        """Return the types of a call of a Python method, by the method's annotations."""
        hints = get_type_hints(inspect.unwrap(method), include_extras=True)
        _, *parameters = inspect.signature(method).parameters.values()  # all but self
        return cls(name, [each.replace(annotation=hints[each.name]) for each in parameters], hints["return"])

    def call(self, *args: object, **kwargs: object) -> bytes:
        """Return a call in the name of who acts now. Raises TypeError for other arguments, BadDocument."""
        bound = self._signature.bind(*args, **kwargs)
        bound.apply_defaults()
        head = _Head(call=self.name, actor=actor(), request_id=request_id())
        return _HEAD.encode(head) + b"\n" + self._arguments.encode(tuple(bound.arguments.values()))

    def arguments(self, document: bytes) -> dict[str, object]:
        """Return the arguments by name. Raises BadDocument."""
        return dict(zip(self._signature.parameters, self._arguments.decode(document), strict=True))


MethodOf = Callable[[str], RpcMethod]


def read_call(document: bytes, method_of: MethodOf) -> tuple[Call, RpcMethod]:
    """Return a call with its method. Raises BadDocument for what is no call, BadInput for one of an unknown name."""
    first, _, second = document.partition(b"\n")
    head = _HEAD.decode(first)
    method = method_of(head.call)
    return Call(head.call, method.arguments(second), head.actor, head.request_id), method


def supervisor_method(name: str) -> RpcMethod:
    """Return the method of a call that a supervisor makes. Raises BadInput for any other name."""
    if name == "supervise":
        return RpcMethod(name, [parameter("wanted", BenchSettings)], None)
    if name == "address.give_back":
        return RpcMethod(name, [], None)
    raise BadInput(
        f"the bench process has no call {name[:60]!r}; stop the service and start it again, so that all its processes "
        "have one version of labctl"
    )


def parameter(name: str, kind: Any) -> inspect.Parameter:
    """Return a parameter of a call, of this type."""
    return inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD, annotation=kind)
