"""Whatever is sent to the API, within its description or beside it: no server error, and refusals are explained."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, settings

from instruments.clock import VirtualClock
from labctl.answers.calibrations import FitRequest
from labctl.answers.certification import CertifyRequest
from labctl.api import create_app
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.commands.registry import CERTIFY, FIT, IMPORT_RECORDING
from labctl.services.commands.requests import RecordingFolder, ToUnit, ToVersion
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import load_bench
from labctl.store import Store
from labctl.store.connection.database import Database
from tests.helpers.certifying import REASON
from tests.helpers.paths import EXAMPLES

UNIT = "OSU-FOG-2024"
THERE = {"serial": UNIT, "version": 1, "recording": 1}
#: Seconds of work each: of these only few reach a version that is there.
COSTLY = ("/criticism", "/improve", "/preview", "/residuals", "/pictures", "/assessment", "/certify")
#: Of each operation; drawn from the same seed every time.
EXAMPLES_EACH, SEED = 10, 1


@pytest.fixture(scope="module")
def application(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """The API of a service with a unit, a recording and a calibration in force, and with a bench."""
    store = Store(Database(str(tmp_path_factory.mktemp("api") / "lab.sqlite"), write=True))
    lab_service = LabService(store, VirtualClock(), BenchRunner(store, load_bench("single-axis-sim"), VirtualClock))
    lab_service.execute(IMPORT_RECORDING, RecordingFolder(EXAMPLES / "osu-fog"))
    lab_service.execute(FIT, ToUnit(UNIT, FitRequest(effects=["bias", "scale_factor"])))
    lab_service.execute(CERTIFY, ToVersion(UNIT, 1, CertifyRequest(by="A", reason=REASON, override=True)))
    made = create_app(lab_service)
    assert schema["/health"]["GET"].Case().call(app=made).status_code == 200  # begins the event loop that all share
    yield made
    schemathesis.python.asgi.shutdown_lifespans()


#: The description needs no service. The application that is asked is made later, and given with every call.
schema = schemathesis.openapi.from_dict(create_app(None).openapi(), config=schemathesis.Config(seed=SEED))
schema.app = create_app


@schema.parametrize()
@settings(max_examples=EXAMPLES_EACH, suppress_health_check=list(HealthCheck))
def test_nothing_that_is_sent_is_a_server_error(case: Any, application: Any) -> None:
    for name, there in THERE.items():  # half of what is asked is asked of what is there
        dear = 16 if name == "version" and case.path.endswith(COSTLY) else 2
        if name in case.path_parameters and zlib.crc32(str(case.path_parameters[name]).encode()) % dear == 0:
            case.path_parameters[name] = there
    answer = case.call(app=application)
    assert answer.status_code < 500, f"{case.as_curl_command()}\n{answer.text}"
    if answer.status_code >= 400:
        assert answer.headers["content-type"][0] == "application/problem+json"
        assert answer.json()["detail"]
