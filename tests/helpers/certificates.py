"""A unit with a certified version, and an order with every fact that a certificate needs."""

from __future__ import annotations

from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from labctl.answers.calibrations import FitRequest
from labctl.answers.certificates import CertificateOrder, CertificateRequest, CertificateResponse
from labctl.recording import Recording, to_points
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.certificates.issue import issue
from labctl.store import CertificateForms, Store, open_store
from tests.helpers.simulated_recordings import single_axis

SERIAL = "FOG-0001"
AT = datetime(2027, 3, 1, 12, tzinfo=UTC)
ORDER: dict[str, Any] = {
    "laboratory": {
        "name": "Inertial Laboratory & Sons", "street": "Example Road 5", "post_code": "12345", "city": "Exampletown",
        "country": "DE", "email": "lab@example.org", "url": "https://lab.example.org", "procedure": "LAB-P-012",
        "number_prefix": "ICL-", "accreditation": "D-K-00000-01-00",
    },
    "customer": {
        "name": "Vehicle Works <Ltd.>", "street": "Track 1", "post_code": "ME1 1AA", "city": "Rochester",
        "country": "GB", "email": "r.driver@example.org", "contact": "R. Driver", "order": "PO-4711",
    },
    "item": {"manufacturer": "KVH", "condition": "No visible damage.", "identification": "VW-G-17"},
    "method": {"name": "rate sweep on a rate table", "deviations": "One rate was left out."},
    "conformity": {"specification": "VW-77, 3.2", "limit_dps": 3.0, "about": "own axis", "rule": "guard-band"},
}  # fmt: skip


def order(**changed: Any) -> CertificateOrder:
    """Return the order with parts of it changed; a part that is None is left out."""
    return CertificateOrder.model_validate({k: v for k, v in {**ORDER, **changed}.items() if v is not None})


def request(**changed: Any) -> CertificateRequest:
    """Return the request of a certificate, its order changed."""
    return CertificateRequest(by="I. Issuer", order=order(**changed))


@cache
def simulated() -> Recording:
    """Return the means of a simulated unit about one axis, with what its bench states of its standards."""
    return to_points(single_axis(1))


def add_version(store: Store, recording: Recording | None = None, *, certified: bool = True) -> int:
    """Add a recording and a version fitted to it, which is put in force; returns its number."""
    store.recordings.add_import(recording or simulated(), AT)
    made = fit_unit(store, SERIAL, FitRequest(effects=["bias", "scale_factor"]), AT).version
    if certified:
        store.calibrations.certify(SERIAL, made, "certify", by="Ada Authoriser", reason="meets the criteria", at=AT)
    return made


@cache
def issued() -> tuple[CertificateResponse, CertificateForms]:
    """Return a certificate in its forms; made once."""
    with TemporaryDirectory() as folder, open_store(str(Path(folder) / "lab.sqlite"), write=True) as store:
        answer = issue(store, SERIAL, add_version(store), request(), AT)
        return answer, store.certificates.forms(answer.number)
