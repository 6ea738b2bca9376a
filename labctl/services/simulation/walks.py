"""Walks through plans in the simulated world, kept as files: many questions walk through the same plans."""

from __future__ import annotations

import hashlib
import io
import zlib
from typing import Any

import numpy as np

from instruments.bench_config import BenchFile
from labctl.recording import Recording, RecordingInfo
from labctl.services.cache import FileCache
from labctl.services.simulation.plan_simulation import hidden_recording
from procedures.planning.plan import Plan

#: Readings per second at which a plan is walked through: its channels are slow.
WALK_HZ = 1.0
#: Readings of the shortest data set, at least: fewer do not show how large their white noise is.
MIN_READINGS = 10
SEED = 1
#: A file has up to a megabyte for each 10,000 s of readings.
WALKS = FileCache("walks", ".npz.zlib", most=60)
#: Level of compression: NumPy's own takes twice as long, and makes files smaller by a hundredth.
LEVEL = 1
#: The prefix of a column of the readings and of the environment log in a file.
READINGS, ENVIRONMENT = "readings/", "environment/"


def walked(plan: Plan, bench: BenchFile) -> Recording:
    """Return what the first gyro of a bench gives on a plan in the simulated world, without drift. Raises BadInput.

    It is asked for its channels and for how long what lasts.
    """
    steps = hashlib.sha256(plan.model_dump_json().encode()).hexdigest()
    on, hz = bench.model_dump(mode="json"), _walk_hz(plan, bench)
    question = {"kind": "walk", "plan": steps, "bench": on, "hz": hz, "seed": SEED}
    return WALKS.get(question, _decoded, lambda: _encoded(_walk(plan, bench)))


def _walk(plan: Plan, bench: BenchFile) -> Recording:
    gyro = bench.gyros[0].model_copy(update={"sample_rate_hz": _walk_hz(plan, bench)})
    return hidden_recording(plan, bench, gyro, SEED, {}, drifts=False)


def _walk_hz(plan: Plan, bench: BenchFile) -> float | None:
    """Return the readings per second of a walk: those of the unit where the rate changes within a data set."""
    if plan.recipe.profiles:
        return bench.gyros[0].sample_rate_hz
    shortest_s = min((step.duration_s for step in plan.steps if step.kind == "acquire"), default=np.inf)
    return max(WALK_HZ, MIN_READINGS / shortest_s)


def _encoded(walk: Recording) -> bytes:
    packed = io.BytesIO()
    # NumPy's keyword `allow_pickle` has another type than the arrays
    arrays: dict[str, Any] = {READINGS + name: values for name, values in walk.columns.items()}
    arrays |= {ENVIRONMENT + name: values for name, values in (walk.environment or {}).items()}
    info = np.frombuffer(walk.info.model_dump_json().encode(), dtype=np.uint8)
    np.savez(packed, info=info, **arrays)
    return zlib.compress(packed.getvalue(), LEVEL)


def _decoded(content: bytes) -> Recording:
    try:
        unpacked = io.BytesIO(zlib.decompress(content))
    except zlib.error as error:
        raise EOFError(f"damaged file: {error}") from error  # as NumPy does: the cache computes it again
    with np.load(unpacked, allow_pickle=False) as arrays:
        info = RecordingInfo.model_validate_json(arrays["info"].tobytes())
        readings, environment = (
            {name.removeprefix(kind): arrays[name] for name in arrays.files if name.startswith(kind)}
            for kind in (READINGS, ENVIRONMENT)
        )
    if len({values.shape for values in readings.values()}) != 1:
        raise ValueError("damaged file: columns of unequal lengths")
    return Recording(info, readings, environment or None)
