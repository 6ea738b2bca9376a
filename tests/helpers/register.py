"""Entries of the register of standards, and units that were measured with them on a day."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, date, datetime, time
from typing import Any

from instruments.standards import Standard
from labctl.answers.calibrations import FitRequest
from labctl.answers.standards import (
    StandardBadRequest,
    StandardCertificateRequest,
    StandardCheckRequest,
    StandardRequest,
    StandardResponse,
)
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.standards import register
from labctl.store import Store
from tests.helpers.certificates import simulated

COUNTER = Standard(
    quantity="clock", name="counter", u=0.5, certificate="C-1", issued_by="PTB", calibrated=date(2023, 11, 20),
    due=date(2030, 1, 1),
)  # fmt: skip


def noon(day: date) -> datetime:
    return datetime.combine(day, time(12), UTC)


def thermometer(certificate: str, **changed: Any) -> Standard:
    """Return the entry of a bench file for the thermometer of these tests."""
    return Standard.model_validate(
        {"quantity": "thermometer", "name": "Pt100-7", "u": 0.02, "certificate": certificate, "issued_by": "DKD",
         "calibrated": "2023-12-01", "due": "2030-01-01", **changed}
    )  # fmt: skip


def add(store: Store, label: str = "Pt100-7", at: date = date(2023, 12, 15), **changed: Any) -> StandardResponse:
    """Enter a standard."""
    request = {"label": label, "quantity": "thermometer", "serial": "SN-0815", "by": "M. Metrologist", **changed}
    return register.add_standard(store, StandardRequest.model_validate(request), noon(at))


def certificate(
    store: Store, number: str, calibrated: date, value: float | None, expanded: float = 0.04, **changed: Any
) -> StandardResponse:
    """Enter a certificate of the thermometer with one point, on the day of its calibration."""
    request = {
        "number": number, "laboratory": "DKD", "calibrated": calibrated, "by": "M. Metrologist",
        "points": [{"value": value, "expanded": expanded}], **changed,
    }  # fmt: skip
    asked = StandardCertificateRequest.model_validate(request)
    return register.add_certificate(store, "Pt100-7", asked, noon(calibrated))


def check(store: Store, day: date, value: float, u: float = 0.01, **changed: Any) -> StandardResponse:
    """Enter an intermediate check of the thermometer."""
    request = {"value": value, "u": u, "by": "T. Technician", **changed}
    return register.add_check(store, "Pt100-7", StandardCheckRequest.model_validate(request), noon(day))


def bad(store: Store, first: date, last: date | None, at: date) -> StandardResponse:
    """Enter that the thermometer was found bad."""
    asked = StandardBadRequest(bad_from=first, bad_until=last, reason="sheath is broken", by="M. Metrologist")
    return register.mark_bad(store, "Pt100-7", asked, noon(at))


def measured(store: Store, serial: str, day: date, *standards: Standard) -> int:
    """Import a recording that was made on a day with standards, fit and certify it; returns the version."""
    recording = simulated()
    info = recording.info.model_copy(update={"serial": serial, "started_at": noon(day), "standards": standards})
    store.recordings.add_import(replace(recording, info=info), noon(day))
    version = fit_unit(store, serial, FitRequest(effects=["bias", "scale_factor"]), noon(day)).version
    store.calibrations.certify(serial, version, "certify", by="Ada Authoriser", reason="meets them", at=noon(day))
    return version
