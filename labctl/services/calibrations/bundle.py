"""Writing a bundle: the certified calibrations of one model, or of all units, in one signed file."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
import zipfile
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from labctl.answers.bundle import BundleResponse
from labctl.bundle import (
    MANIFEST,
    SIGNATURE,
    BundleEntry,
    BundleManifest,
    WithdrawnEntry,
    signed_digest,
)
from labctl.calibration import with_certification
from labctl.canonical_json import canonical
from labctl.config import SEAL_KEY_VARIABLE, seal_key
from labctl.errors import BadInput, NotFound
from labctl.services.calibrations.served import certification_of, notice_of
from labctl.store import Signer, Store, signer_of

#: Date of every member: the same content gives the same bytes.
MEMBER_DATE = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class BundleOptions:
    """Which units, for how long, and whether without a signature."""

    model: str | None  #: None: of every model
    valid_for: timedelta | None = None  #: None: without a date
    unsigned: bool = False


def write_bundle(store: Store, file: Path, options: BundleOptions, at: datetime) -> BundleResponse:
    """Write the certified calibrations of a model's units into a new file, signed by the seal key.

    The file appears once it is whole. Raises BadInput without a seal key, or for a file that is there; NotFound where
    no unit has a certified version.
    """
    signer = None if options.unsigned else _signer()
    if file.exists():
        raise BadInput(f"{file}: the file exists already, and no bundle is overwritten; name a new file")
    try:
        handle, name = tempfile.mkstemp(dir=file.parent, prefix=f".{file.name}-")
    except OSError as error:
        raise BadInput(f"{file}: {error.strerror}; name a file in a folder that can be written") from error
    part = Path(name)
    try:
        with os.fdopen(handle, "wb") as opened, zipfile.ZipFile(opened, "w", zipfile.ZIP_DEFLATED) as archive:
            manifest = _written(store, archive, options, at)
            content = canonical(manifest.to_json())
            _add(archive, MANIFEST, content)
            if signer is not None:
                signature = signer.sign(signed_digest(content)).hex()
                signature_document = {"fingerprint": signer.public.fingerprint, "signature": signature}
                _add(archive, SIGNATURE, json.dumps(signature_document).encode())
        part.chmod(0o644)
        part.replace(file)
    finally:
        part.unlink(missing_ok=True)
    with file.open("rb") as whole:
        digest = hashlib.file_digest(whole, "sha256").hexdigest()
    return BundleResponse(
        file=str(file), model=manifest.model, calibrations=len(manifest.calibrations),
        withdrawn=len(manifest.withdrawn), bytes=file.stat().st_size, sha256=digest, made_at=manifest.made_at,
        expires_at=manifest.expires_at, signed_by=None if signer is None else signer.public.fingerprint,
    )  # fmt: skip


def _signer() -> Signer:
    if setting := seal_key():
        return signer_of(setting)
    raise BadInput(
        f"{SEAL_KEY_VARIABLE} is not set, so the bundle would have no signature; name the seal key by it, or write a "
        "bundle without a signature with --unsigned"
    )


def _written(store: Store, archive: zipfile.ZipFile, options: BundleOptions, at: datetime) -> BundleManifest:
    """Write the calibration files, one after the other; returns the manifest."""
    entries: list[BundleEntry] = []
    withdrawn: list[WithdrawnEntry] = []
    for serial, version in store.certifications.newest_versions(options.model):
        served = store.certifications.served(serial, version)
        known = None if served is None else certification_of(served)
        if served is None or known is None:
            continue
        if (notice := notice_of(served)) is not None:
            withdrawn.append(WithdrawnEntry(serial, version, notice))
            continue
        content, _ = with_certification(served.document, known)
        name = f"calibrations/{len(entries) + 1:07d}.json"
        _add(archive, name, content)
        entries.append(BundleEntry(serial, version, name, hashlib.sha256(content).hexdigest()))
    if not entries and not withdrawn:
        units = "no unit" if options.model is None else f"no unit of the model {options.model!r}"
        raise NotFound(f"{units} has a certified version; certify one, or name another model (`labctl units`)")
    expires_at = None if options.valid_for is None else at + options.valid_for
    return BundleManifest(options.model, at, expires_at, tuple(entries), tuple(withdrawn))


def _add(archive: zipfile.ZipFile, name: str, content: bytes) -> None:
    member = zipfile.ZipInfo(name, MEMBER_DATE)
    member.compress_type = zipfile.ZIP_DEFLATED
    archive.writestr(member, content)
