"""The names of uvicorn that the bounded protocol uses and uvicorn's documentation does not have.

A new release of uvicorn may change each of them without notice. When a test fails after an update: read the changes
of `uvicorn/protocols/http/httptools_impl.py` and `flow_control.py` between the two releases; adapt
`labctl/api/http_protocol.py` and the lists below; run tests/labctl/api/test_bounded_http.py,
tests/labctl/api/test_hostile_requests.py and tests/system/test_connection_attacks.py; then set `MINOR` to the new
release.
"""

from __future__ import annotations

import ast
import asyncio
import inspect
import tomllib
from importlib.metadata import version
from typing import Any

import pytest
from packaging.requirements import Requirement
from uvicorn.config import Config
from uvicorn.protocols.http.flow_control import FlowControl
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle
from uvicorn.server import ServerState

from labctl.api import http_protocol
from tests.helpers.source_files import ROOT

MINOR = "0.54"
#: Method -> its parameters after self. Those of the protocol are extended or called, those of httptools by its parser.
METHODS = {
    "__init__": ("config", "server_state", "app_state", "_loop"),
    "connection_made": ("transport",),
    "connection_lost": ("exc",),
    "data_received": ("data",),
    "on_message_begin": (),
    "on_url": ("url",),
    "on_header": ("name", "value"),
    "on_headers_complete": (),
    "on_body": ("body",),
    "on_message_complete": (),
    "on_response_complete": (),
    "send_400_response": ("msg",),
    "_start_asgi_task": ("cycle", "app"),
    "_unsupported_upgrade_warning": (),
}
#: Attribute of a connection -> type, once it is made; None: any, or not yet there before a request.
ATTRIBUTES: dict[str, type | None] = {
    "client": None, "cycle": None, "flow": FlowControl, "headers": None, "loop": asyncio.AbstractEventLoop,
    "pipeline": None, "scope": None, "transport": None,
}  # fmt: skip
OF_A_CYCLE = ("response_started", "response_complete", "disconnected", "message_event")
OF_THE_FLOW = ("read_paused", "write_paused")
DO = "read the docstring of tests/labctl/api/test_uvicorn_names.py"


class Transport(asyncio.Transport):
    """A transport that leads nowhere."""

    def get_extra_info(self, name: str, default: Any = None) -> Any:
        return default


def connection() -> HttpToolsProtocol:
    async def app(_scope: object, _receive: object, _send: object) -> None:
        """Answer nothing."""

    loop = asyncio.new_event_loop()
    try:
        made = HttpToolsProtocol(Config(app, interface="asgi3"), ServerState(), {}, loop)
        made.connection_made(Transport())
        return made
    finally:
        loop.close()


def test_uvicorn_is_the_release_whose_names_these_are() -> None:
    wanted = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]["lab"]
    (uvicorn,) = (each for each in map(Requirement, wanted) if each.name == "uvicorn")
    assert version("uvicorn").startswith(f"{MINOR}."), f"uvicorn is {version('uvicorn')}, not {MINOR}; {DO}"
    for other, fits in ((f"{MINOR}.99", True), ("0.55.0", False), ("1.0.0", False)):
        assert uvicorn.specifier.contains(other) == fits, f"pyproject.toml: uvicorn{uvicorn.specifier}; {DO}"


@pytest.mark.parametrize("name", METHODS)
def test_each_method_takes_what_it_is_given(name: str) -> None:
    found = getattr(HttpToolsProtocol, name, None)
    assert found is not None, f"uvicorn's HttpToolsProtocol has no method {name}; {DO}"
    _, *parameters = inspect.signature(found).parameters
    assert tuple(parameters) == METHODS[name], f"HttpToolsProtocol.{name}{inspect.signature(found)}; {DO}"


@pytest.mark.parametrize("name", ATTRIBUTES)
def test_a_connection_has_each_attribute(name: str) -> None:
    made, kind = connection(), ATTRIBUTES[name]
    assert hasattr(made, name) or name in HttpToolsProtocol.__annotations__, f"a connection has no {name}; {DO}"
    assert kind is None or isinstance(getattr(made, name), kind), f"{name} is no {kind}; {DO}"


def test_requests_and_flow_have_what_is_read_and_set() -> None:
    init = inspect.signature(RequestResponseCycle.__init__)
    given: dict[str, Any] = dict.fromkeys(list(init.parameters)[1:])
    cycle = RequestResponseCycle(**given | {"message_event": asyncio.Event()})
    for name in OF_A_CYCLE:
        assert hasattr(cycle, name), f"uvicorn's RequestResponseCycle has no {name}; {DO}"
    assert (cycle.response_started, cycle.response_complete, cycle.disconnected) == (False, False, False), DO
    flow = FlowControl(Transport())
    for name in OF_THE_FLOW:
        assert getattr(flow, name, None) is False, f"uvicorn's FlowControl has no {name}; {DO}"


def test_no_other_name_is_used() -> None:
    tree = ast.parse(inspect.getsource(http_protocol))
    (protocol,) = (each for each in tree.body if isinstance(each, ast.ClassDef) and each.name == "BoundedHttpProtocol")
    own = {each.name for each in protocol.body if isinstance(each, ast.FunctionDef)} | {
        each.target.id
        for each in protocol.body
        if isinstance(each, ast.AnnAssign) and isinstance(each.target, ast.Name)
    }
    used: dict[str, set[str]] = {}
    for each in ast.walk(protocol):
        if isinstance(each, ast.Attribute):
            used.setdefault(ast.unparse(each.value), set()).add(each.attr)
            if ast.unparse(each.value) == "self" and isinstance(each.ctx, ast.Store):
                own.add(each.attr)
    extended = {name for name in own if hasattr(HttpToolsProtocol, name)}
    assert used["super()"] | extended == set(METHODS), DO
    assert used["self"] - own == set(ATTRIBUTES), DO
    assert used["self.flow"] == set(OF_THE_FLOW), DO
    cycles = used["cycle"] | used["self.cycle"] | used["self._answered"]
    assert cycles == set(OF_A_CYCLE), DO
    private = [each.module for each in tree.body if isinstance(each, ast.ImportFrom) and "._" in f".{each.module}"]
    assert private == ["__future__"]
