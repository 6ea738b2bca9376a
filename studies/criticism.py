"""Who names what is hidden: labctl's criticism on campaigns with an effect of known size, and with none."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from labctl.fitting.context import context_of
from labctl.fitting.criticism import Criticism, criticise
from labctl.fitting.presets import preset_for
from studies.campaigns import MODELS, OUTSIDE, PROTOCOLS, campaign, sizes

Z_LEVELS = (5.0, 10.0, 30.0, 100.0)
PER_CELL = int(os.environ.get("LABCTL_STUDY_CAMPAIGNS", "100"))
CACHE = Path(os.environ.get("LABCTL_STUDY_FOLDER", "study-output"))


def one(task: dict[str, Any]) -> dict[str, Any]:
    """Simulate one campaign, criticise it, and return what was said."""
    recording = campaign(task["protocol"], task["seed"], task["hidden"], **task.get("spoiled", {}))
    model, _ = preset_for(MODELS[task["protocol"]], []).build(context_of(recording))
    found = criticise(recording, model, full=False)
    top = [(c.id, c.smooth, round(c.log_bf, 2)) for c in found.weighed.candidates[:4]] if found.weighed else []
    return {**task, "verdict": found.verdict.form, "named": list(found.verdict.named), "nodes": nodes(found),
            "depends_on": list(found.verdict.depends_on)[:3], "top": top}  # fmt: skip


def nodes(found: Criticism) -> int:
    """Return how many different things were named; effects with the same columns are one with several names."""
    if found.verdict.form == "missing":
        return len(found.verdict.named)
    known = {c.id: round(c.log_bf, 6) for c in found.weighed.candidates if not c.smooth} if found.weighed else {}
    return len({known.get(effect) for effect in found.verdict.named})


def tasks() -> Iterator[dict[str, Any]]:
    """Yield every campaign of the study, effects drawn evenly."""
    for name in PROTOCOLS:
        for k in range(PER_CELL):
            yield {"protocol": name, "kind": "nothing", "z": 0.0, "seed": 10_000 + k, "hidden": {}}
        sized = sizes(name, Z_LEVELS, CACHE)
        inside = [effect for effect in sized if effect not in OUTSIDE]
        for z in Z_LEVELS:
            for k in range(PER_CELL):
                effect = inside[k % len(inside)]
                size = sized[effect][f"{z:g}"]
                yield {"protocol": name, "kind": "effect", "z": z, "seed": 20_000 + k, "hidden": {effect: size}}
            for effect in set(sized) & set(OUTSIDE):
                for k in range(max(PER_CELL // 5, 2)):
                    size = sized[effect][f"{z:g}"]
                    yield {"protocol": name, "kind": "outside", "z": z, "seed": 30_000 + k, "hidden": {effect: size}}


def _key(task: dict[str, Any]) -> str:
    return json.dumps({k: task[k] for k in ("protocol", "kind", "z", "seed", "hidden")}, sort_keys=True)


def run() -> dict[str, float]:
    """Run what is not yet there, and return the rates."""
    CACHE.mkdir(parents=True, exist_ok=True)
    kept = CACHE / "criticism.jsonl"
    done = {_key(r): r for r in map(json.loads, kept.read_text().splitlines())} if kept.exists() else {}
    left = [task for task in tasks() if _key(task) not in done]
    with kept.open("a") as out, ProcessPoolExecutor(max_workers=2) as pool:
        for answer in pool.map(one, left, chunksize=1):
            done[_key(answer)] = answer
            out.write(json.dumps(answer) + "\n")
            out.flush()
    return rates([done[_key(task)] for task in tasks()])


def rates(answers: list[dict[str, Any]]) -> dict[str, float]:
    """Return the shares that the accuracy table is made of."""
    found: dict[str, float] = {}
    null = [a for a in answers if a["kind"] == "nothing"]
    found["false_alarms"] = float(np.mean([a["verdict"] != "adequate" for a in null]))
    for z in Z_LEVELS:
        cell = [a for a in answers if a["kind"] == "effect" and a["z"] == z]
        truth = [next(iter(a["hidden"])) for a in cell]
        found[f"right_or_group_z{z:g}"] = float(np.mean([t in a["named"] for t, a in zip(truth, cell, strict=True)]))
        alone = [t in a["named"] and a["nodes"] == 1 for t, a in zip(truth, cell, strict=True)]
        found[f"right_alone_z{z:g}"] = float(np.mean(alone))
        wrong = [a["nodes"] == 1 and t not in a["named"] for t, a in zip(truth, cell, strict=True)]
        found[f"wrong_single_z{z:g}"] = float(np.mean(wrong))
        outside = [a for a in answers if a["kind"] == "outside" and a["z"] == z]
        if outside:
            channel = [OUTSIDE[next(iter(a["hidden"]))] for a in outside]
            said = [
                a["verdict"] == "unexplained" and a["depends_on"][:1] == [c]
                for c, a in zip(channel, outside, strict=True)
            ]
            found[f"outside_said_z{z:g}"] = float(np.mean(said))
            found[f"outside_named_z{z:g}"] = float(np.mean([bool(a["named"]) for a in outside]))
    return found
