"""A bundle: the calibrations of many units in one file, for vehicles without a network.

The file is a zip archive. `manifest.json` names every calibration file with its SHA-256, the versions that were
withdrawn, and when the bundle was made; `signature.json` has a signature over the manifest. With the library alone the
hashes are checked, which finds what was damaged or changed by mistake; with the public key of the laboratory, and the
extra `seal`, the signature is checked too, which finds what was changed on purpose.
"""

from __future__ import annotations

import hashlib
import json
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from instruments.clock import Clock, SystemClock
from labctl.answers.json_object import JsonObject
from labctl.calibration import Calibration, read_calibration
from labctl.calibration.document import MAX_BYTES
from labctl.closing import ClosedAtEnd
from labctl.compensator import Compensator, Outside
from labctl.errors import BadCalibrationFile, BundleExpired, CalibrationOverdue, CalibrationWithdrawn, NotFound
from labctl.public_keys import PublicKey, read_public_key
from labctl.withdrawal import Withdrawn

FORMAT = "labctl-bundle/1"
MANIFEST, SIGNATURE = "manifest.json", "signature.json"
#: The largest manifest that is read: a million calibrations have some 250 MB.
MAX_MANIFEST_BYTES = 512 << 20

#: What reading a member of a damaged archive raises.
UNREADABLE = (
    KeyError, zipfile.BadZipFile, OSError, RuntimeError, NotImplementedError, EOFError, ValueError, zlib.error,
)  # fmt: skip


@dataclass(frozen=True)
class BundleEntry:
    """A calibration file in a bundle."""

    serial: str
    version: int
    file: str
    sha256: str


@dataclass(frozen=True)
class WithdrawnEntry:
    """A version that was withdrawn when the bundle was made: its calibration is not in the bundle."""

    serial: str
    version: int
    notice: Withdrawn


@dataclass(frozen=True)
class BundleManifest:
    """Content of a bundle; times are aware UTC."""

    model: str | None  #: of the units; None: of every model
    made_at: datetime
    expires_at: datetime | None  #: from then on the bundle is refused; None: it has no such date
    calibrations: tuple[BundleEntry, ...]
    withdrawn: tuple[WithdrawnEntry, ...]

    def to_json(self) -> JsonObject:
        """Return it as the document in `manifest.json`."""
        return {
            "format": FORMAT, "model": self.model, "made_at": self.made_at.isoformat(),
            "expires_at": self.expires_at.isoformat() if self.expires_at else None,
            "calibrations": [vars(each) for each in self.calibrations],
            "withdrawn": [
                {
                    "serial": each.serial, "version": each.version, "at": each.notice.at.isoformat(),
                    "by": each.notice.by, "reason": each.notice.reason, "certificate": each.notice.certificate,
                }
                for each in self.withdrawn
            ],
        }  # fmt: skip


def signed_digest(manifest: bytes) -> str:
    """Return what a signature of a bundle is over: never the hash of anything else that the same key signs."""
    return hashlib.sha256(FORMAT.encode() + b"\n" + manifest).hexdigest()


class Bundle(ClosedAtEnd):
    """An open bundle. `serials` are its units; `is_signature_checked` says whether a public key was given."""

    def __init__(
        self, path: Path, archive: zipfile.ZipFile, manifest: BundleManifest, *, checked: bool, clock: Clock
    ) -> None:
        self._path, self._archive, self._clock = path, archive, clock
        self.manifest, self.is_signature_checked = manifest, checked
        self._entries = {each.serial: each for each in manifest.calibrations}
        self._withdrawn = {each.serial: each for each in manifest.withdrawn}

    @classmethod
    def open(cls, path: Path | str, *, public_key: Path | str | None = None, clock: Clock | None = None) -> Bundle:
        """Open a bundle; with the file of a `public_key` its signature has to be by that key.

        Raises BadCalibrationFile for a file that is damaged, of another format, without a signature or with a wrong
        one, BundleExpired for a bundle whose date has passed by `clock` (the computer's).
        """
        where, now_clock = Path(path), clock or SystemClock()
        key = None if public_key is None else read_public_key(Path(public_key))
        try:
            archive = zipfile.ZipFile(where)
        except (zipfile.BadZipFile, OSError) as error:
            raise BadCalibrationFile(f"{where}: not a bundle of calibrations ({error}); get it again") from error
        try:
            content = _member(where, archive, MANIFEST, MAX_MANIFEST_BYTES)
            if key is not None:
                _refuse_unsigned(where, archive, content, key)
            manifest = _manifest(where, content)
            if manifest.expires_at is not None and now_clock.utc() >= manifest.expires_at:
                raise BundleExpired(
                    f"{where}: the bundle was made at {_said(manifest.made_at)} and expired at "
                    f"{_said(manifest.expires_at)}: a calibration may have been withdrawn since; export a new bundle"
                )
        except BaseException:
            archive.close()
            raise
        return cls(where, archive, manifest, checked=key is not None, clock=now_clock)

    def close(self) -> None:
        """Close the file."""
        self._archive.close()

    @property
    def serials(self) -> tuple[str, ...]:
        """The units with a calibration in the bundle."""
        return tuple(self._entries)

    def content(self, serial: str) -> bytes:
        """Return the bytes of a unit's calibration file, as the service serves them.

        Raises CalibrationWithdrawn, NotFound for a unit that the bundle does not have, BadCalibrationFile for a file
        with another hash than the manifest names.
        """
        if (gone := self._withdrawn.get(serial)) is not None:
            text = f"calibration of {serial} version {gone.version} must not be used: {gone.notice.text}"
            raise CalibrationWithdrawn(f"{text}; calibrate the unit again, then export a new bundle", gone.notice)
        if (entry := self._entries.get(serial)) is None:
            raise NotFound(
                f"{self._path}: no calibration of unit {serial!r} among {len(self._entries)}; check the serial number, "
                "or export a bundle once the unit has a certified version"
            )
        content = _member(self._path, self._archive, entry.file, MAX_BYTES)
        if (sha256 := hashlib.sha256(content).hexdigest()) != entry.sha256:
            raise BadCalibrationFile(
                f"{self._path}: {entry.file} of unit {serial} has the SHA-256 {sha256}, the manifest names "
                f"{entry.sha256}: the file was changed; get the bundle again"
            )
        return content

    def calibration(self, serial: str) -> Calibration:
        """Return the calibration of a unit. Raises as `content`, and CalibrationOverdue past its due date."""
        calibration = read_calibration(self.content(serial))
        certification = calibration.certification
        if calibration.serial != serial or certification is None:
            raise BadCalibrationFile(
                f"{self._path}: the calibration of unit {serial} is that of unit {calibration.serial}, or is not "
                "certified; export the bundle again"
            )
        if certification.is_overdue(self._clock.utc()):
            raise CalibrationOverdue(
                certification.warning(f"{serial} version {calibration.version}", self._clock.utc())
            )
        return calibration

    def compensator(self, serial: str, outside: Outside = "clamp") -> Compensator:
        """Return what corrects the output of a unit. Raises as `calibration`."""
        return Compensator(self.calibration(serial), outside, clock=self._clock)

    def verify(self) -> None:
        """Check the hash of every calibration file. Raises BadCalibrationFile for the first that does not fit."""
        for serial in self._entries:
            self.content(serial)


def _member(path: Path, archive: zipfile.ZipFile, name: str, max_bytes: int) -> bytes:
    """Return one member, bounded: what a header says of its size is not believed. Raises BadCalibrationFile."""
    try:
        with archive.open(name) as opened:
            content = opened.read(max_bytes + 1)
    except UNREADABLE as error:
        raise BadCalibrationFile(f"{path}: {name} cannot be read ({error}); get the bundle again") from error
    if len(content) > max_bytes:
        raise BadCalibrationFile(f"{path}: {name} has more than {max_bytes} bytes, the limit; get the bundle again")
    return content


def _refuse_unsigned(path: Path, archive: zipfile.ZipFile, manifest: bytes, key: PublicKey) -> None:
    if SIGNATURE not in archive.namelist():
        raise BadCalibrationFile(
            f"{path}: the bundle has no signature, and one by the key {key.fingerprint} is asked for; export it with "
            "the seal key"
        )
    try:
        signature_document = json.loads(_member(path, archive, SIGNATURE, MAX_BYTES))
        signature, by = bytes.fromhex(signature_document["signature"]), str(signature_document["fingerprint"])
    except (ValueError, LookupError, TypeError) as error:
        raise BadCalibrationFile(f"{path}: {SIGNATURE} is not whole; get the bundle again") from error
    if not key.fits(signature, signed_digest(manifest)):
        raise BadCalibrationFile(
            f"{path}: the signature of the bundle, by the key {by[:64]}, is none of the key {key.fingerprint} over "
            "this content: the bundle was changed, or is another laboratory's; get it again"
        )


def _manifest(path: Path, content: bytes) -> BundleManifest:
    try:
        document = json.loads(content)
        if document["format"] != FORMAT:
            raise ValueError(f"the format is {str(document['format'])[:80]!r}, but must be {FORMAT!r}")
        due = document["expires_at"]
        return BundleManifest(
            None if document["model"] is None else str(document["model"]), _instant(document["made_at"]),
            None if due is None else _instant(due),
            tuple(
                BundleEntry(str(each["serial"]), int(each["version"]), str(each["file"]), str(each["sha256"]))
                for each in document["calibrations"]
            ),
            tuple(_withdrawn(each) for each in document["withdrawn"]),
        )  # fmt: skip
    except (ValueError, LookupError, TypeError, RecursionError) as error:
        raise BadCalibrationFile(f"{path}: {MANIFEST} is not whole ({error}); get the bundle again") from error


def _withdrawn(document: Mapping[str, Any]) -> WithdrawnEntry:
    notice = Withdrawn(
        _instant(document["at"]), str(document["by"]), str(document["reason"]), str(document["certificate"])
    )
    return WithdrawnEntry(str(document["serial"]), int(document["version"]), notice)


def _instant(text: Any) -> datetime:
    instant = datetime.fromisoformat(text)
    if instant.tzinfo is None:
        raise ValueError(f"{text!r} has no time zone")
    return instant.astimezone(UTC)


def _said(at: datetime) -> str:
    return f"{at.astimezone(UTC):%Y-%m-%d %H:%M} UTC"
