"""The effect that the model of Yang et al. lacks: fitted, criticised, added; in a database of its own."""

from __future__ import annotations

import tempfile
from pathlib import Path

from instruments.clock import VirtualClock
from labctl.progress import report_stage
from labctl.recording import Recording
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.calibrations.revision import improve_unit
from labctl.services.criticism.criticise import criticise_unit
from labctl.services.reproduction.findings import Findings, Value
from labctl.services.schemas.calibrations import FitRequest, ImproveRequest
from labctl.store import Store, open_store


def demonstrate(readings: Recording, of: str) -> Findings:
    """Fit yang2018 to readings, ask what is missing, add it, and ask again."""
    with (
        tempfile.TemporaryDirectory(prefix="labctl-reproduce-") as folder,
        open_store(str(Path(folder) / "paper.sqlite"), write=True) as store,
    ):
        return _in(store, readings, of)


def _in(store: Store, readings: Recording, of: str) -> Findings:
    at, serial = VirtualClock().utc(), readings.info.serial
    number = store.recordings.add_import(readings, at)
    fitted = fit_unit(store, serial, FitRequest(recording=number, model="yang2018"), at)
    report_stage("criticise yang2018: which effect is missing")
    answer = criticise_unit(store, serial, None, None)
    error = fitted.error
    stalled = (
        f"The model yang2018 lacks an effect: it reduces the RMS error from {_said(error.raw_rms_dps)} to "
        f"{_said(error.rms_dps)} deg/s, but the noise floor is {_said(error.noise_floor_dps)} deg/s. The criticism of "
        f"the model reports: {' '.join(answer.text)}"
    )
    found = Findings(
        story=[stalled],
        values=[
            Value("stalled", of, error.rms_dps, "bias, scale factor and misalignment cannot follow the curve"),
            Value("floor", of, error.noise_floor_dps, error.noise_floor_source),
        ],
    )
    if not answer.named:
        return found
    added = answer.named[0]
    report_stage(f"add {added} and criticise again")
    better = improve_unit(store, serial, ImproveRequest(add=[added]), at)
    after = better.error
    again = criticise_unit(store, serial, None, None)
    found.story.append(
        f"With {added} added, the RMS error is {_said(after.rms_dps)} deg/s, and {_said(after.heldout_rms_dps)} deg/s "
        f"at temperatures left out of the fit. The criticism of this model reports: {' '.join(again.text)}"
    )
    found.values += [
        Value("improved", of, after.rms_dps, f"{added}, as criticism named it"),
        Value("improved_heldout", of, after.heldout_rms_dps, "each inner temperature by a fit without it"),
    ]
    return found


def _said(value: float | None) -> str:
    return "an unknown" if value is None else f"{value:.4f}"
