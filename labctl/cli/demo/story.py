"""The order of the demo."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

from pydantic import JsonValue

from instruments.clock import VirtualClock
from labctl.answers.certification import CertifyRequest
from labctl.answers.fitted_model import ErrorFiguresJson
from labctl.cli.demo import example_data, find_missing_effect, serve_calibrations, single_axis, triaxial
from labctl.cli.demo.runner import DemoRunner, maybe_silent
from labctl.errors import BadInput
from labctl.fitting.estimation.error_metrics import first_of_smallest
from labctl.services.calibrations.certification import put_in_force
from labctl.store import open_store

DATABASE = "demo.sqlite"


def run_demo(folder: Path, database: str | None, *, quick: bool, quiet: bool) -> dict[str, JsonValue]:
    """Play the whole story into `folder`; returns its figures, each computed in this run."""
    location = database or str(_fresh(folder) / DATABASE)
    with maybe_silent(quiet) as console, open_store(location, write=True) as store:
        demo = DemoRunner(store, folder, console, quiet)
        example_data.play(demo)  # the first results within seconds; the long campaign comes last
        single_axis.play(demo)
        find_missing_effect.play(demo, "OSU-FOG-2024")
        triaxial.play(demo, quick=quick)
        serials = [triaxial.SERIAL, single_axis.SERIAL, "WEISS-ENV05S", "OSU-FOG-2024"]
        demo.title("Certified: for each unit, the first version of those with the least held-out error")
        for serial in serials:
            _certify_best(demo, serial)
        serve_calibrations.play(demo, serials)
        demo.title("Next steps")
        demo.say(f"labctl serve --simulate --database {location}     then http://127.0.0.1:8420/api-docs")
        demo.say(f"labctl campaign list --database {location};  labctl calibration FOG-0001 --database {location}")
    return demo.figures


def _certify_best(demo: DemoRunner, serial: str) -> None:
    """Put the first version of those with the least error in force; objections are printed, and overridden."""
    request = CertifyRequest(by="the demo", reason="computed and checked in this run of the demo", override=True)
    rows = sorted(demo.store.calibrations.of_unit(serial), key=lambda row: row.version)
    points = sum(len(demo.store.recordings.data_sets(number)) for number in rows[0].recordings)
    best = rows[first_of_smallest([_least_known(row.answer["error"]) for row in rows], points)]
    # no second person: the demo certifies units of its own
    act = put_in_force(demo.store, serial, best.version, request, VirtualClock().utc(), None)
    demo.say(f"{serial} version {act.version} ({best.model}): verdict {act.verdict or f'none, {act.verdict_reason}'}")
    for each in act.objections:
        demo.say(f"  overridden: {each['text']}")


def _least_known(error: ErrorFiguresJson) -> float:
    known = (error["heldout_rms_dps"], error["rms_dps"])
    return next((value for value in known if value is not None), math.inf)


def _fresh(folder: Path) -> Path:
    """Return an empty folder; one that an earlier demo made is emptied, any other is left alone."""
    if folder.exists() and any(folder.iterdir()):
        if not (folder / DATABASE).exists():
            raise BadInput(
                f"{folder}: the folder is not empty and not from an earlier demo; name another folder with --out DIR"
            )
        shutil.rmtree(folder)
    folder.mkdir(parents=True, exist_ok=True)
    return folder
