"""Whatever is sent to the API, within its description or beside it: no server error, and refusals are explained."""

from __future__ import annotations

import asyncio
import zlib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier
from typing import Any
from unittest.mock import patch

import pytest
import requests
import schemathesis
from hypothesis import HealthCheck, settings
from schemathesis.generation.feedback import FeedbackSources
from schemathesis.pytest._test_builder import build_operation_test
from schemathesis.python import asgi
from schemathesis.python._constants.orchestrator import make_constants_value_source

from instruments.clock import VirtualClock
from labctl.answers.calibrations import FitRequest
from labctl.api import create_app
from labctl.api.dependencies import CONTROL_THREADS, ControlPool
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.commands.registry import FIT, IMPORT_RECORDING
from labctl.services.commands.requests import RecordingFolder, ToUnit
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import load_bench
from labctl.store import Store
from labctl.store.connection.database import Database
from tests.helpers.certifying import REASON
from tests.helpers.openapi import openapi_document, operations
from tests.helpers.paths import EXAMPLES
from tests.helpers.patience import WAIT_S

UNIT = "OSU-FOG-2024"
THERE = {"serial": UNIT, "version": 1, "recording": 1}
#: Seconds of work each: of these only few reach a version that is there.
COSTLY = ("/criticism", "/improve", "/preview", "/residuals", "/pictures", "/assessment", "/certify")
#: Requests for each operation, drawn from the same seed every time.
REQUESTS, SEED = 20, 1


@pytest.fixture(scope="module")
def application(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """The API of a service with a unit, a recording and a calibration in force, and with a bench."""
    store = Store(Database(str(tmp_path_factory.mktemp("api") / "lab.sqlite"), write=True))
    lab_service = LabService(store, VirtualClock(), BenchRunner(store, load_bench("single-axis-sim"), VirtualClock))
    lab_service.execute(IMPORT_RECORDING, RecordingFolder(EXAMPLES / "osu-fog"))
    lab_service.execute(FIT, ToUnit(UNIT, FitRequest(effects=["bias", "scale_factor"])))
    # the command would criticise it first: 5 s of work
    store.calibrations.certify(UNIT, 1, "certify", by="A", reason=REASON, at=VirtualClock().utc())
    made = create_app(lab_service)
    health = schema_of(openapi_document())["/health"]["GET"]
    end_services = asgi.shutdown_lifespans
    with (
        patch.object(asgi, "shutdown_lifespans"),  # schemathesis would end the service after the first test
        patch.object(requests.sessions, "get_environ_proxies", return_value={}),  # asked for with each request: a tenth
    ):
        assert health.Case().call(app=made).status_code == 200  # begins the event loop that all share
        begin_threads(made.state.control_pool)
        yield made
    end_services()


def begin_threads(pool: ControlPool) -> None:
    """Begin all threads of a pool, which belong to the service and not to the test of the first who needs one."""
    together = Barrier(CONTROL_THREADS)

    async def begin() -> None:
        await asyncio.gather(*(pool.run(together.wait) for _ in range(CONTROL_THREADS)))

    with ThreadPoolExecutor(1) as thread:
        thread.submit(asyncio.run, begin()).result()


def schema_of(document: dict[str, Any]) -> Any:
    """Return what makes requests of a document. The application that is asked is given with every call."""
    schema = schemathesis.openapi.from_dict(document, config=schemathesis.Config(seed=SEED))
    schema.app = create_app
    return schema


@settings(max_examples=REQUESTS, suppress_health_check=list(HealthCheck))
def ask(case: Any, application: Any, statuses: set[int]) -> None:
    for name, there in THERE.items():  # half of what is asked is asked of what is there
        dear = 16 if name == "version" and case.path.endswith(COSTLY) else 2
        if name in case.path_parameters and zlib.crc32(str(case.path_parameters[name]).encode()) % dear == 0:
            case.path_parameters[name] = there
    answer = case.call(app=application, timeout=WAIT_S)
    statuses.add(answer.status_code)
    assert answer.status_code < 500, f"{case.as_curl_command()}\n{answer.text}"
    if answer.status_code >= 400:
        assert answer.headers["content-type"][0] == "application/problem+json"
        assert answer.json()["detail"]


@pytest.mark.slow
@pytest.mark.parametrize(("method", "path"), operations())
def test_nothing_that_is_sent_is_a_server_error(method: str, path: str, application: Any) -> None:
    """Build the requests of an operation when it is tested.

    `parametrize` of the whole description builds those of all operations in every worker while it collects, and with
    pytest 9 gives all its tests the same name, of which pytest-xdist then runs one.
    """
    schema = schema_of(openapi_document() | {"paths": {path: {method: openapi_document()["paths"][path][method]}}})
    asked = build_operation_test(
        config=schema.config, operation=schema[path][method.upper()], test_func=ask, given_kwargs={},
        feedback=FeedbackSources(constants_value_source=make_constants_value_source(schema)),
    )  # fmt: skip
    statuses: set[int] = set()
    asked(application=application, statuses=statuses)
    assert statuses
