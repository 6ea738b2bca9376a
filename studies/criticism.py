"""Who names what is hidden: labctl's criticism, and other tools on the same campaigns."""

from __future__ import annotations

import hashlib
import json
import os
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from labctl.errors import LabctlError
from labctl.fitting.criticism import Criticism, criticise
from labctl.fitting.criticism.verdict import overlap
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.presets import changed, preset_for
from labctl.recording import Recording
from studies import baselines, report_tables
from studies.campaigns import MODELS, OUTSIDE, PROTOCOLS, campaign
from studies.effect_sizes import sizes

Task = dict[str, Any]
ROOT = Path(__file__).resolve().parent.parent
#: Sizes of hidden effects, in noise units.
Z_LEVELS = (5.0, 10.0, 30.0, 100.0)
TWO_AT_Z = 20.0
#: Size at which the fall of the held-out error is computed.
HELD_OUT_AT_Z = 30.0
PER_CELL = int(os.environ.get("LABCTL_STUDY_CAMPAIGNS", "100"))
#: Campaigns of a cell beside the main ones: fewer.
PER_EXTRA = max(PER_CELL // 2, 1)
PER_OUTSIDE = max(PER_CELL // 5, 1)
WITH_PEERS = os.environ.get("LABCTL_STUDY_PEERS", "1") != "0"
FOLDER = Path(os.environ.get("LABCTL_STUDY_FOLDER", "study-output"))
#: What is wrong with a campaign besides what is hidden.
SPOILED: dict[str, dict[str, float]] = {
    "spoiled": {"outliers": 0.01, "missing": 0.03},
    "drifting": {"drift": 3.0},
}
#: Answers belong to this code; other code begins a new file of answers.
ANSWERED_BY = (
    "labctl/fitting",
    "labctl/recording",
    "instruments/simulators",
    "studies/campaigns.py",
    "studies/baselines.py",
)


def tasks() -> Iterator[Task]:
    """Yield every campaign of the study, effects drawn evenly."""
    for name in PROTOCOLS:
        sized = sizes(name)
        inside = sorted(set(sized) - set(OUTSIDE))
        for k in range(PER_CELL):
            yield _task(name, "nothing", 0.0, 10_000 + k, {})
        for kind in SPOILED:
            for k in range(PER_EXTRA):
                yield _task(name, kind, 0.0, 40_000 + k, {})
        for z in Z_LEVELS:
            for k in range(PER_CELL):
                yield _task(name, "effect", z, 20_000 + k, _at(sized, z, inside[k % len(inside)]))
            for effect in sorted(set(sized) & set(OUTSIDE)):
                for k in range(PER_OUTSIDE):
                    yield _task(name, "outside", z, 30_000 + k, _at(sized, z, effect))
        for k in range(PER_EXTRA):
            two = np.random.default_rng([50_000, k]).choice(inside, 2, replace=False)
            yield _task(name, "two", TWO_AT_Z, 50_000 + k, _at(sized, TWO_AT_Z, *map(str, two)))


def _at(sized: dict[str, dict[str, float]], z: float, *effects: str) -> dict[str, float]:
    return {effect: sized[effect][f"{z:g}"] for effect in effects}


def _task(protocol: str, kind: str, z: float, seed: int, hidden: dict[str, float]) -> Task:
    return {"protocol": protocol, "kind": kind, "z": z, "seed": seed, "hidden": hidden}


def one(task: Task) -> Task:
    """Simulate one campaign, criticise it, ask the other tools, and return what was said."""
    clock = _Stopwatch()
    recording = clock("simulate", lambda: _recording(task))
    model, _ = preset_for(MODELS[task["protocol"]], []).build(fit_data_of(recording))
    found = clock("labctl", lambda: criticise(recording, model, full=False))
    answer = {**task, **_said(found)}
    if task["kind"] == "effect" and task["z"] == HELD_OUT_AT_Z and found.verdict.form == "missing":
        answer["held_out"] = clock("improve", lambda: held_out(recording, model, found))
    if task["kind"] == "drifting" and found.comparison is not None:
        answer["large_drift"] = found.has_large_drift
    if WITH_PEERS and found.comparison is not None:
        designs = found.comparison.designs
        answer["peers"] = clock("peers", lambda: baselines.ask(found.data, designs))
    return {**answer, "seconds": clock.seconds}


def _recording(task: Task) -> Recording:
    return campaign(task["protocol"], task["seed"], task["hidden"], **SPOILED.get(task["kind"], {}))


class _Stopwatch:
    """What each part of a campaign took, s."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    def __call__(self, name: str, work: Callable[[], Any]) -> Any:
        begun = time.process_time()
        done = work()
        self.seconds[name] = round(time.process_time() - begun, 3)
        return done


def _said(found: Criticism) -> dict[str, Any]:
    top = [(c.id, c.smooth, round(c.log_bf, 2)) for c in found.comparison.candidates[:4]] if found.comparison else []
    return {
        "verdict": found.verdict.form,
        "named": list(found.verdict.named),
        "groups": [list(group) for group in found.verdict.groups],
        "nodes": nodes(found),
        "alike": alike(found),
        "depends_on": list(found.verdict.depends_on)[:3],
        "top": top,
    }


def alike(found: Criticism) -> float:
    """Return the least share of the leader's signal that another effect named with it reproduces, 0 to 1.

    At 1 they cannot be distinguished on this schedule, whatever its readings.
    """
    if found.comparison is None or len(found.verdict.groups) != 1:
        return 0.0
    known = {c.id: c for c in found.comparison.candidates if not c.smooth}
    named = [known[name] for name in found.verdict.named if name in known]
    return min((overlap(found.comparison, named[0], rival) for rival in named[1:]), default=1.0) if named else 0.0


def nodes(found: Criticism) -> int:
    """Return how many different things were named; effects with the same columns are one with several names."""
    if found.verdict.form == "missing":
        return len(found.verdict.named)
    known = {c.id: round(c.log_bf, 6) for c in found.comparison.candidates if not c.smooth} if found.comparison else {}
    return len({known.get(effect) for effect in found.verdict.named})


def held_out(recording: Recording, model: ErrorModel, found: Criticism) -> float | None:
    """Return held-out RMS over floor with what was named added; None where that cannot be fitted or inverted."""
    try:
        error = fit_preset(fit_data_of(recording), changed(model, tuple(found.verdict.terms.values()))).error
    except LabctlError:
        return None
    if not error.noise_floor_dps or error.heldout_rms_dps is None:
        return None
    return float(error.heldout_rms_dps / error.noise_floor_dps)


def _key(task: Task) -> str:
    return json.dumps({k: task[k] for k in ("protocol", "kind", "z", "seed", "hidden")}, sort_keys=True)


def answers_file() -> Path:
    """Return where the answers of this code are kept."""
    digest = hashlib.sha256()
    for place in ANSWERED_BY:
        path = ROOT / place
        for source in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            digest.update(source.read_bytes())
    return FOLDER / f"criticism-{digest.hexdigest()[:8]}{'' if WITH_PEERS else '-alone'}.jsonl"


def run() -> str:
    """Run what is not yet there, and return the tables."""
    if WITH_PEERS and (absent := baselines.missing()):
        return f"not installed: {', '.join(absent)}; `make study` installs them, LABCTL_STUDY_PEERS=0 does without"
    kept = answers_file()
    kept.parent.mkdir(parents=True, exist_ok=True)
    wanted = list(tasks())
    done = _read(kept)
    left = [task for task in wanted if _key(task) not in done]
    print(f"{len(wanted)} campaigns, {len(wanted) - len(left)} of them in {kept}", file=sys.stderr)
    with kept.open("a") as out, ProcessPoolExecutor(max_workers=2) as pool:
        for number, answer in enumerate(pool.map(one, left), start=1):
            done[_key(answer)] = answer
            out.write(json.dumps(answer) + "\n")
            out.flush()
            if number % 50 == 0:
                print(f"{number} of {len(left)}", file=sys.stderr)
    return report_tables.report([done[_key(task)] for task in wanted], baselines.versions() if WITH_PEERS else {})


def _read(kept: Path) -> dict[str, Task]:
    """Return the answers of earlier runs; a line that was cut off when a run was stopped does not count."""
    found: dict[str, Task] = {}
    for line in kept.read_text().splitlines() if kept.exists() else []:
        try:
            answer = json.loads(line)
        except ValueError:
            continue
        found[_key(answer)] = answer
    return found
