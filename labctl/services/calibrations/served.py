"""Calibrations as files for consumers, with the certification in them and the HTTP headers beside them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Final

from labctl.answers.certification import CalibrationStateResponse, WithdrawnResponse
from labctl.answers.judgement import JudgementDetail
from labctl.answers.noise import AllanJson
from labctl.calibration import read_calibration, with_certification
from labctl.calibration.certification import Certification, State
from labctl.errors import BadInput, NotFound
from labctl.exports import Loss, format_named, written_calibration
from labctl.exports.noise.figures import DPS_RTHZ_PER_DEG_RTH, DPS_S_RTHZ_PER_DEG_H_RTH, RATE, WALK, WHITE
from labctl.services.calibrations.certification import version_in_force
from labctl.services.recordings.allan import MAX_RECORDINGS, noise_of_recordings
from labctl.store import ServedCalibration, Store
from labctl.withdrawal import HEADER, Withdrawn, quoted


@dataclass(frozen=True)
class Exported:
    """A calibration in a consumer's format, and what the format lost."""

    content: bytes
    media_type: str
    tag: str  #: of format and options, for the end of an ETag
    losses: tuple[Loss, ...] = ()


def exported(store: Store, document: bytes, format_name: str, options: Sequence[str] = ()) -> Exported:
    """Return a calibration document in a consumer's format. Options: lines KEY=VALUE.

    Raises BadInput for an unknown format or option, and for a calibration that the format cannot carry.
    """
    given_options = read_options(options, format_name)
    chosen = format_named(format_name)
    if chosen.needs_noise:
        given_options = {**_noise(store, document, chosen.options), **given_options}
    written = written_calibration(document, format_name, given_options)
    tag = "-".join([format_name, *(f"{key}={value}" for key, value in sorted(given_options.items()))])
    plain = "".join(char if char.isascii() and char.isprintable() and char not in '"\\' else "_" for char in tag)
    return Exported(written.content, chosen.media_type, plain, written.losses)


def read_options(lines: Sequence[str], format_name: str) -> dict[str, str]:
    """Return options by name from lines KEY=VALUE; raises BadInput for another form, or one that is given twice."""
    options: dict[str, str] = {}
    for line in lines:
        key, sign, value = (part.strip() for part in line.partition("="))
        if not (sign and key and value) or key in options:
            raise BadInput(f"format {format_name}: option {line!r}: give each option once, as KEY=VALUE")
        options[key] = value
    return options


def _noise(store: Store, document: bytes, wanted: Mapping[str, str]) -> dict[str, str]:
    """Return the noise of the unit as options, from the recording that its performance sheet takes it from."""
    calibration = read_calibration(document)
    try:
        rows = store.recordings.of_unit(calibration.serial)
    except NotFound:  # a file of a unit that is not in this database
        return {}
    newest = sorted(rows, key=lambda row: row.id, reverse=True)[:MAX_RECORDINGS]
    answer = noise_of_recordings(store, newest)
    if answer is None:
        return {}
    options = noise_options([answer.axes[axis] for axis in calibration.axes if axis in answer.axes])
    return {key: value for key, value in options.items() if key in wanted}


def noise_options(axes: Sequence[AllanJson]) -> dict[str, str]:
    """Return the noise figures of a unit's axes as options of a format; without those that an axis lacks."""
    options: dict[str, str] = {}
    for name, figures, unit_symbol in (
        (WHITE, [axis["N"] for axis in axes], DPS_RTHZ_PER_DEG_RTH),
        (WALK, [axis["K"] for axis in axes], DPS_S_RTHZ_PER_DEG_H_RTH),
    ):
        values = [figure["value"] for figure in figures]
        if values and all(value is not None and value > 0 for value in values):
            options[name] = ",".join(f"{value * unit_symbol:.9e}" for value in values if value is not None)
    shortest = [axis["tau_s"][0] for axis in axes if axis["tau_s"]]
    if shortest and shortest[0]:
        options[RATE] = f"{1 / shortest[0]:.9g}"
    return options


#: State of a version that was never certified.
NOT_CERTIFIED: Final = "not-certified"


@dataclass(frozen=True)
class CalibrationFile:
    """A calibration as a consumer gets it: bytes, their tag, and the certification that is in them, if there is one."""

    content: bytes
    media_type: str
    etag: str
    serial: str
    version: int
    certification: Certification | None
    losses: tuple[Loss, ...] = ()  #: what the format does not carry
    withdrawn: Withdrawn | None = None  #: it was revoked, or its certificate was withdrawn

    @property
    def what(self) -> str:
        """Unit and version."""
        return f"{self.serial} version {self.version}"

    def headers(self, now: datetime) -> dict[str, str]:
        """Return the HTTP headers beside the bytes at an aware time: tag, state, due date, warning and notice."""
        certification = self.certification
        response_headers = {"ETag": f'"{self.etag}"', "Cache-Control": "no-cache", "X-Labctl-State": NOT_CERTIFIED}
        if certification is None:
            return response_headers
        response_headers["X-Labctl-State"] = certification.state
        if certification.due is not None and certification.state != "revoked":
            response_headers["X-Labctl-Due"] = f"{certification.due.astimezone(UTC):%Y-%m-%dT%H:%M:%SZ}"
        if text := certification.warning(self.what, now):
            response_headers["Warning"] = f"299 labctl {quoted(text)}"
        if self.withdrawn is not None:
            response_headers[HEADER] = self.withdrawn.header()
        return response_headers


def calibration_file(
    store: Store, serial: str, version: int | None, format_name: str, options: Sequence[str] = ()
) -> CalibrationFile:
    """Return a calibration in a consumer's format; without a version the certified one. Options: lines KEY=VALUE.

    The file of a version that was ever certified has its `certification`, and a hash over that too. Raises NotFound,
    NotCertified, BadInput for an unknown format or option, and for a calibration that the format cannot carry.
    """
    served = store.certifications.served(serial, version)
    if served is None:
        document, hash_ = store.calibrations.document(serial, version)  # says why there is none
        served = ServedCalibration(document, hash_, None, in_force=False)
    number = served.act.version if served.act else version or store.calibrations.certified_version(serial)
    own = own_file(serial, number, served)
    if format_name == "json" and not options:
        return own
    file = exported(store, own.content, format_name, options)
    return replace(
        own, content=file.content, media_type=file.media_type, etag=f"{own.etag}-{file.tag}", losses=file.losses
    )


def own_file(serial: str, version: int, served: ServedCalibration) -> CalibrationFile:
    """Return a version of a unit in labctl's own format, with its certification in it where it was ever certified."""
    certification = certification_of(served)
    content, tag = served.document, served.hash
    if certification is not None:
        content, tag = with_certification(content, certification)
    return CalibrationFile(
        content, "application/json", tag, serial, version, certification, withdrawn=notice_of(served)
    )


def calibration_state(store: Store, serial: str, calibration_hash: str) -> CalibrationStateResponse:
    """Return which state a version is in, by the hash of its calibration. Raises NotFound."""
    known_serial = store.units.get(serial).serial
    version = store.calibrations.version_of(known_serial, calibration_hash)
    served = store.certifications.served(known_serial, version) if version is not None else None
    if version is None or served is None:
        raise NotFound(
            f"unit {serial!r} has no calibration with the hash {calibration_hash[:64]!r}; give `calibration_hash` of a "
            "calibration file (64 hexadecimal digits)"
        )
    certification, gone = certification_of(served), notice_of(served)
    return CalibrationStateResponse(
        serial=known_serial, version=version, calibration_hash=served.hash,
        state=certification.state if certification else NOT_CERTIFIED,
        due=certification.due if certification else None,
        withdrawn=gone and WithdrawnResponse(at=gone.at, by=gone.by, reason=gone.reason, certificate=gone.certificate),
        in_force=version_in_force(store, known_serial),
    )  # fmt: skip


def notice_of(served: ServedCalibration) -> Withdrawn | None:
    """Return the notice for those who fetch a version: it was revoked, or its certificate was withdrawn.

    A certification after the withdrawal ends the notice: a person has then vouched for the version again.
    """
    act, gone = served.act, served.withdrawal
    if act is None:
        return None
    if act.act == "revoke":
        return Withdrawn(act.at, act.by, act.reason)
    if gone is not None and gone.act == served.act_number:  # not by dates: a clock may have been set back
        return Withdrawn(gone.at, gone.by, gone.reason, served.certificate or "")
    return None


def certification_of(served: ServedCalibration) -> Certification | None:
    """Return the certification that a version's file has; None where the version was never certified."""
    if (act := served.act) is None:
        return None
    state: State = "in-force" if served.in_force else "revoked" if act.act == "revoke" else "superseded"
    detail: JudgementDetail = json.loads(served.judgement or "{}")
    unknown = tuple(detail.get("cause_not_known", ()))
    return Certification(state, act.by, act.reason, act.at, act.due_at, served.hash, unknown)
