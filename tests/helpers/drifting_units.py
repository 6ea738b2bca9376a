"""Units of one model whose certified calibrations differ by a drift: documents of one fit, changed and certified."""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from labctl.calibration import hash_of
from labctl.canonical_json import canonical
from labctl.recording import Recording
from labctl.store import CalibrationRecord, NewCalibration, Store, open_store
from tests.helpers.certificates import AT, SERIAL, add_version, simulated

BEGUN = datetime(2026, 2, 1, tzinfo=UTC)
MODEL = "KVH E-Core RD2100"


@cache
def fitted() -> CalibrationRecord:
    """Return a version that was fitted to the simulated unit, of which bias and scale factor are known."""
    with TemporaryDirectory() as folder, open_store(str(Path(folder) / "lab.sqlite"), write=True) as store:
        return store.calibrations.get(SERIAL, add_version(store, certified=False))


def add_drifting_unit(
    store: Store,
    serial: str,
    bias_dps: Mapping[float, float],
    *,
    model: str = MODEL,
    warm_c: tuple[float, float] | None = None,
    real: bool = False,
    due: datetime | None = None,
) -> int:
    """Add a unit with a certified version for each year of `bias_dps`, its bias changed by so much; returns the last.

    The range of temperatures is `warm_c` instead of that of the fit. A `real` unit was not measured on a simulated
    bench.
    """
    version = 0
    for years, bias in bias_dps.items():
        whole = simulated()
        told = {"serial": serial, "model": model, "started_at": BEGUN + timedelta(days=365.25 * years)}
        head = {name: values[:1] for name, values in whole.columns.items()}
        number = store.recordings.add_import(Recording(whole.info.model_copy(update=told), head), AT)
        version = store.calibrations.next_version(serial)
        content = document(serial, version, bias, warm_c, real=real)
        new = NewCalibration(None, number, "custom", content, json.loads(content)["hash"], fitted().answer)
        store.calibrations.add(serial, AT, version, new)
        store.calibrations.certify(serial, version, "certify", by="A", reason="meets the criteria", at=AT, due_at=due)
    return version


def document(serial: str, version: int, bias_dps: float, warm_c: tuple[float, float] | None, *, real: bool) -> bytes:
    """Return the document of the fit with another bias."""
    found = json.loads(fitted().document)
    found |= {"serial": serial, "version": version}
    found["model"]["axes"]["z"]["values"][0][0] += bias_dps
    found["validity"]["temperature_c"] = found["validity"]["temperature_c"] if warm_c is None else list(warm_c)
    for each in found["standards"]["stated"]:
        each["traceability"] = "national institute" if real else "none: simulated"
    found["hash"] = hash_of(found)
    return canonical(found) + b"\n"
