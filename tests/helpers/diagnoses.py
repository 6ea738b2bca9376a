"""Diagnoses whose criticisms are given by a test: what a verdict says, and which experiments it proposes."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path

import tomli_w

from labctl.answers.calibrations import FitRequest
from labctl.answers.campaigns import StartRequest
from labctl.answers.common_fields import CriticismVerdict
from labctl.answers.criticism import CriticismResponse, Experiment
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.campaigns.execution import run_here
from labctl.services.diagnosis.foreground import ForegroundLaboratory
from labctl.store import open_store

NOW = datetime(2026, 11, 1, tzinfo=UTC)
UNIT = "FOG-0001"

#: A recipe that takes less than a tenth of a second in virtual time.
TINY = {
    "name": "tiny",
    "temperatures_c": [25.0],
    "rates_dps": [0.0],
    "positions": ["z"],
    "soak": {"hold_s": 1.0, "max_drift_c": 5.0, "drift_window_s": 60.0},
    "acquire": {"duration_s": 1.0, "settle_s": 0.0},
}


def experiment(do: str, hours: float = 2.0, **changes: object) -> Experiment:
    """Return an experiment that distinguishes thermal_lag from warm_up; `changes` are of its recipe."""
    recipe = {**TINY, "name": "tiny-next", **changes}
    return Experiment(
        separates=["thermal_lag", "warm_up"], do=do, recipe={}, toml=tomli_w.dumps(recipe), power=0.96, hours=hours,
        why=f"{hours:.1f} h on the bench are expected to say which of 2 effects it is.", block="tiny", needs=[],
        names_wrong=0.0, information_bit=0.9, open_bit=1.0, person_h=0.0, mountings=0, per_hour=0.9 / hours,
    )  # fmt: skip


def criticism(
    verdict: CriticismVerdict, *named: str, experiments: Sequence[Experiment] = (), recordings: Sequence[int] = (1,)
) -> CriticismResponse:
    """Return a criticism with a verdict and the experiments that it proposes."""
    document = {
        "serial": "FOG-0001", "version": 1, "recording": recordings[-1], "recordings": list(recordings),
        "verdict": verdict, "text": [f"the verdict is {verdict}"],
        "error": {
            "rms_dps": 0.02, "heldout_rms_dps": None, "noise_floor_dps": 0.001, "noise_floor_source": "std",
            "explained": 0.9, "direct_form_rms_dps": None,
        },
        "noise": {"white_dps": None, "drift_dps": None, "drift_tau_s": None, "vs_datasheet": None, "static": None},
        "lack_of_fit": {"statistic": None, "p_value": None}, "where": [], "suspects": [], "named": list(named),
        "depends_on": ["temperature_c"], "not_testable": [], "experiments": [dict(each) for each in experiments],
    }  # fmt: skip
    return CriticismResponse.model_validate(document)


def fitted_database(folder: Path) -> Path:
    """Return a database with a simulated unit in which an effect is hidden, its recording and a version."""
    location = folder / "lab.sqlite"
    run_here(str(location), StartRequest(recipe="short", bench="single-axis-sim", hide=["warm_up=0.05"]))
    with open_store(str(location), write=True) as store:
        fit_unit(store, UNIT, FitRequest(effects=["bias", "scale_factor"]), NOW)
    return location


def copied(database: Path, folder: Path) -> str:
    """Copy a database, which no process may have open, into a folder; returns where the copy is."""
    folder.mkdir(exist_ok=True)
    for part in database.parent.iterdir():
        shutil.copy(part, folder)
    return str(folder / database.name)


class ScriptedLaboratory(ForegroundLaboratory):
    """Runs campaigns in this process; what a criticism says is given, by the number of recordings that it judges."""

    script: Callable[[list[int]], CriticismResponse]

    def criticise(self, serial: str, version: int, recordings: list[int]) -> CriticismResponse:
        """Return what the script says of the recordings."""
        del serial, version
        return self.script(recordings)
