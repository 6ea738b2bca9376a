"""No public function, method, field or alias says Any, but for those below, each with its reason."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.annotations import public_signatures_with_any
from tests.helpers.source_files import SourceFile, sources

PASSED_ON = "settings of a library's constructor, passed on as they are; the library leaves them without types"
DIFFERENT = "objects of one generic class, each with types of its own, in a row"
STRUCTLOG = "what structlog hands its processors: a record's fields may hold anything"
KIND = "a type, of any kind that Python has for one: a class, a union, a generic with its arguments"
DRIVER = "arguments of psycopg's connect, passed on as they are"
ROWS = "a statement of any columns and its rows, whose fields its caller knows"
BY_NAME = "the name of the call says which types its arguments and its answer have, which are checked at both ends"
#: Module -> what says Any there, and why.
ALLOWED = {
    "instruments/conformance/stand.py": ({"Stand.driver"}, "a driver of any kind: the checks of its kind know which"),
    "instruments/drivers/registry.py": ({"Driver"}, DIFFERENT),
    "instruments/drivers/resolution.py": (
        {"driver_of"},
        "the driver of the settings' own class, which its caller names",
    ),
    "instruments/simulation.py": ({"simulation_plugins"}, DIFFERENT),
    "instruments/simulators/links/modbus_clients.py": (
        {"SimulatedTcpClient.__init__", "SimulatedRtuClient.__init__"},
        PASSED_ON,
    ),
    "instruments/simulators/links/serial_port.py": ({"SimulatedSerialPort.__init__"}, PASSED_ON),
    "labctl/api/descriptions.py": ({"DescribedAPI.openapi"}, "the document is FastAPI's, which types it so"),
    "labctl/cli/commands/fleet.py": ({"JobOptions.carry_out"}, "options of one command; its request checks them"),
    "labctl/cli/option_groups.py": ({"with_options"}, "commands of any signature, as typer takes them"),
    "labctl/log/redaction.py": ({"Redaction.fields"}, STRUCTLOG),
    "labctl/log/rendering.py": ({"Fields", "Rendering.__call__", "error_fields"}, STRUCTLOG),
    "labctl/processes/rpc_methods.py": ({"RpcMethod.__init__", "parameter"}, KIND),
    "labctl/processes/rpc.py": ({"Answer.value", "RpcClient.call"}, BY_NAME),
    "labctl/processes/documents.py": ({"Form.__init__"}, KIND),
    "labctl/service_connection.py": (
        {"ServiceConnection.request", "json_of"},
        "keyword arguments of httpx, passed on; JSON before its model has looked at it",
    ),
    "labctl/services/commands/acts/catalogue.py": ({"BENCH_ACTS", "CAMPAIGN_ACTS"}, DIFFERENT),
    "labctl/services/commands/registry.py": ({"COMMANDS"}, DIFFERENT),
    "labctl/services/recordings/importers.py": ({"IMPORTERS"}, DIFFERENT),
    "labctl/store/connection/backend.py": ({"Backend.lookup_connection"}, DRIVER),
    "labctl/store/connection/database.py": ({"Database.lookup"}, ROWS),
    "labctl/store/connection/engines.py": ({"lookup_connection"}, DRIVER),
    "labctl/store/connection/lookup.py": (
        {"FileLookup.__init__", "FileLookup.rows", "Lookup.rows", "ServerLookup.__init__", "ServerLookup.rows"},
        ROWS,
    ),
    "labctl/store/connection/postgresql_server.py": ({"PostgresqlServer.lookup_connection"}, DRIVER),
    "labctl/store/repositories/units.py": ({"unit_rows"}, ROWS),
}


def test_no_public_signature_says_any() -> None:
    runtime = [file for file in sources() if file.is_runtime and "versions" not in file.parts]
    found = {file.name: set(public_signatures_with_any(file)) for file in runtime}
    assert {name: names for name, names in found.items() if names} == {
        name: names for name, (names, _) in ALLOWED.items()
    }


@pytest.fixture
def module(tmp_path: Path) -> SourceFile:
    file = tmp_path / "module.py"
    file.write_text(
        "from typing import Any\nimport typing\n"
        "Alias = dict[str, Any]\nfine = 1\n"
        "def loose(a: int, *b: list[Any]) -> None: ...\n"
        "def result() -> typing.Any: ...\n"
        "def good(a: int) -> dict[str, int]: ...\n"
        "def _private(a: Any) -> Any: ...\n"
        "class Thing:\n"
        "    field: tuple[Any, ...]\n"
        "    _kept: Any\n"
        "    def __init__(self, a: Any) -> None:\n"
        "        self.kept: Any = a\n"
        "    def method(self, a: int) -> None: ...\n",
        encoding="utf-8",
    )
    return SourceFile(file)


def test_any_is_seen_wherever_a_type_stands(module: SourceFile) -> None:
    assert public_signatures_with_any(module) == ["Alias", "loose", "result", "Thing.field", "Thing.__init__"]
