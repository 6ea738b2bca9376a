"""What worker processes compute and write is byte for byte what threads do."""

from __future__ import annotations

from pathlib import Path

import pytest

from instruments.clock import VirtualClock
from labctl.answers.calibrations import FitRequest, ImproveRequest
from labctl.answers.certification import CertifyRequest
from labctl.processes.web_process import WORKER_MODULES
from labctl.recording import write_recording
from labctl.services.calibrations.certification import list_certifications
from labctl.services.calibrations.served import calibration_file
from labctl.services.commands.registry import CERTIFY, FIT, IMPORT_RECORDING, IMPROVE
from labctl.services.commands.requests import RecordingFolder, ToNewestOrVersion, ToUnit, ToVersion
from labctl.services.computation import InThreads, InWorkers, Limits
from labctl.services.criticism.criticise import criticise_unit, residuals_unit
from labctl.services.lab_service import LabService
from labctl.store import open_store
from tests.helpers.computations import Writable
from tests.helpers.simulated_recordings import single_axis

RECORDING = single_axis(1)
UNIT = RECORDING.info.serial
REASON = "the worker has to do the same as the thread"
WORKERS = Limits(at_once=1, niceness=0)


def lived(service: LabService, folder: Path) -> list[str]:
    """Import a recording, fit it, change the fit, certify it, criticise it; returns all answers."""
    answers = [
        service.execute(IMPORT_RECORDING, RecordingFolder(folder)),
        service.execute(FIT, ToUnit(UNIT, FitRequest(effects=["bias", "scale_factor"]))),
        service.execute(IMPROVE, ToNewestOrVersion(UNIT, None, ImproveRequest(formula=["cube: table_rate_dps**3"]))),
        service.execute(CERTIFY, ToVersion(UNIT, 1, CertifyRequest(by="A", reason=REASON, override=True))),
        service.computation.run(criticise_unit, UNIT, 1, None),
        service.computation.run(residuals_unit, UNIT, 1, None),
    ]
    return [answer.model_dump_json() for answer in answers]


def kept(location: str) -> list[object]:
    with open_store(location, write=False) as store:
        files = [calibration_file(store, UNIT, version, "json").content for version in (1, 2)]
        trail = [(row.who, row.action, row.subject, row.detail) for row in store.audit.rows()]
        return [*files, list_certifications(store, UNIT), trail]


@pytest.mark.slow
def test_answers_and_the_database_are_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_recording(RECORDING, tmp_path / "taken in", "parquet")
    here, there = str(tmp_path / "threads.sqlite"), str(tmp_path / "workers.sqlite")
    with open_store(here, write=True) as store:
        by_threads = lived(LabService(store, VirtualClock(), None, InThreads(store)), tmp_path / "taken in")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "of the workers"))
    with open_store(there, write=False) as store:
        workers = InWorkers(store, WORKERS, address=Writable(there), preload=WORKER_MODULES)
        by_workers = lived(LabService(store, VirtualClock(), None, workers), tmp_path / "taken in")
        workers.close()
    assert by_workers == by_threads
    assert kept(there) == kept(here)
    assert list((tmp_path / "of the workers").rglob("*.json"))
