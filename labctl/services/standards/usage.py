"""Where a standard was used: the calibrations that are touched when it is found bad between two days."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import date, timedelta
from typing import TYPE_CHECKING

from labctl.errors import BadInput
from labctl.natural_order import natural_key
from labctl.store import (
    CalibrationRecord,
    RecordingRow,
    RegisteredStandard,
    StandardCertificate,
    StandardFinding,
    Store,
)

if TYPE_CHECKING:
    from instruments.standards import Standard
    from labctl.answers.standards import AffectedCalibration, AffectedResponse

#: First and last day (UTC) of a measurement; None: unknown.
Days = tuple[date | None, date | None]


def performed(store: Store, row: RecordingRow) -> Days:
    """Return the first and the last day of a campaign or of an imported recording."""
    if row.campaign is not None:
        campaign = store.campaigns.get(row.campaign)
        begun = campaign.started_at or campaign.created_at
        return begun.date(), None if campaign.ended_at is None else campaign.ended_at.date()
    from labctl.recording.info import measured_at  # noqa: PLC0415  most answers have no standard that was bad

    at = measured_at(row.info)
    if at is None:
        return None, None
    ends = [data_set.t_until_s for data_set in store.recordings.data_sets(row.id) if data_set.t_until_s is not None]
    return at.date(), (at + timedelta(seconds=max(ends))).date() if ends else None


def is_entry_of(standard: RegisteredStandard, entry: Standard) -> bool:
    """Return whether an entry of a bench file is this standard: by its label or serial number, or a certificate.

    Laboratories number their certificates by themselves: number and issuer together name one.
    """
    return is_named(standard, entry) or any(
        same_issuer(each.laboratory, entry.issued_by) for each in numbered(standard, entry)
    )


def numbered(standard: RegisteredStandard, entry: Standard) -> list[StandardCertificate]:
    """Return the certificates of a standard that have the number, and are of the quantity, of an entry."""
    if not entry.certificate or entry.quantity != standard.row.quantity:
        return []
    return [certificate for certificate in standard.certificates if certificate.number == entry.certificate]


def same_issuer(first: str, second: str) -> bool:
    """Return whether two statements of who issued a certificate agree: by their letters, or one does not say."""
    names = ["".join(filter(str.isalnum, name)).casefold() for name in (first, second)]
    return not all(names) or names[0] == names[1]


def is_named(standard: RegisteredStandard, entry: Standard) -> bool:
    """Return whether an entry of a bench file has the label or the serial number of a standard as its name."""
    return bool(entry.name) and entry.name in (standard.row.label, standard.row.serial)


def uses(row: RecordingRow, standard: RegisteredStandard) -> bool:
    """Return whether a recording was measured with a standard."""
    return any(is_entry_of(standard, each) for each in row.recording_info.standards)


def overlaps(first: date | None, last: date | None, bad_from: date | None, bad_until: date | None) -> bool:
    """Return whether days of a measurement are among those between two others; None: open, or unknown."""
    return (bad_until is None or first is None or first <= bad_until) and (
        bad_from is None or last is None or last >= bad_from
    )


def affected(store: Store, label: str, bad_from: date | None = None, bad_until: date | None = None) -> AffectedResponse:
    """Return the calibrations that rest on measurements with a standard between two days, both included.

    Without days: those of its findings that are in force, else all. Raises NotFound, BadInput for days in reverse.
    """
    from labctl.answers.standards import AffectedResponse  # noqa: PLC0415  as above

    if bad_from is not None and bad_until is not None and bad_until < bad_from:
        raise BadInput(f"from {bad_from} until {bad_until}: the last day is before the first; exchange them")
    standard = store.standards.get(label)
    spans = [(bad_from, bad_until)]
    if bad_from is None and bad_until is None and standard.bad:
        spans = [(each.bad_from, each.bad_until) for each in standard.bad]
    touched = [row for row in store.recordings.all() if uses(row, standard)]
    days = {row.id: performed(store, row) for row in touched}
    inside = {
        row.id: row for row in touched if any(overlaps(*days[row.id], *span) for span in spans)
    }  # fmt: skip
    serials = sorted({row.serial for row in inside.values()}, key=natural_key)
    versions = [
        _affected(store, version, [inside[n] for n in version.recordings if n in inside], days, standard)
        for serial in serials
        for version in reversed(store.calibrations.of_unit(serial))
        if not inside.keys().isdisjoint(version.recordings)
    ]
    starts, ends = [each[0] for each in spans], [each[1] for each in spans]
    return AffectedResponse(
        label=standard.row.label,
        bad_from=None if None in starts else min(start for start in starts if start is not None),
        bad_until=None if None in ends else max(end for end in ends if end is not None),
        calibrations=versions,
        text=list(_text(standard, versions)),
    )


def _affected(
    store: Store,
    version: CalibrationRecord,
    rows: Sequence[RecordingRow],
    days: dict[int, Days],
    standard: RegisteredStandard,
) -> AffectedCalibration:
    from labctl.answers.standards import AffectedCalibration  # noqa: PLC0415  as above

    begun = [day for row in rows if (day := days[row.id][0]) is not None]
    ended = [day for row in rows if (day := days[row.id][1] or days[row.id][0]) is not None]
    known = len(begun) == len(rows)
    history = store.calibrations.history(version.serial)
    return AffectedCalibration(
        serial=version.serial,
        version=version.version,
        recordings=[row.id for row in rows],
        campaigns=sorted({row.campaign for row in rows if row.campaign is not None}),
        performed_from=min(begun) if known else None,
        performed_until=max(ended) if known else None,
        in_force=bool(history) and history[0].act == "certify" and history[0].version == version.version,
        certificates=[
            each.number for each in store.certificates.of_unit(version.serial) if each.version == version.version
        ],
        findings=[
            each.id
            for each in standard.bad
            if any(overlaps(*days[row.id], each.bad_from, each.bad_until) for row in rows)
        ],
    )


def _text(standard: RegisteredStandard, calibrations: Sequence[AffectedCalibration]) -> Iterator[str]:
    label = standard.row.label
    if not calibrations:
        yield f"No calibration was measured with standard {label} on these days."
        return
    units = len({calibration.serial for calibration in calibrations})
    issued = [number for calibration in calibrations for number in calibration.certificates]
    noun = "calibration" if len(calibrations) == 1 else "calibrations"
    of, was = ("unit", "was") if units == 1 == len(calibrations) else ("unit" if units == 1 else "units", "were")
    yield f"{len(calibrations)} {noun} of {units} {of} {was} measured with standard {label} on these days."
    if issued:
        yield f"Certificates issued of them: {', '.join(issued)}. Inform those who hold them, and measure again."
    if any(calibration.in_force for calibration in calibrations):
        yield "Versions in force are among them: revoke them, or state why they remain usable."


@dataclass(frozen=True)
class Notices:
    """The standards that were found bad, read once for many versions."""

    store: Store
    bad: tuple[tuple[RegisteredStandard, StandardFinding], ...]
    _days: dict[int, Days] = field(default_factory=dict)

    @staticmethod
    def of(store: Store) -> Notices:
        """Return what the register says now; one point query where no standard was ever found bad."""
        if not store.standards.has_findings():
            return Notices(store, ())
        return Notices(store, tuple((each, finding) for each in store.standards.all() for finding in each.bad))

    def of_recordings(self, recordings: Sequence[int]) -> list[str]:
        """Return a sentence for each finding on a standard that the recordings were measured with, on those days."""
        return [finding_text(standard, finding) for standard, finding in self._touching(recordings)]

    def for_customers(self, recordings: Sequence[int]) -> list[str]:
        """Return the same for who holds a certificate: without the person and the reason, which are the laboratory's.

        What the standard is, the certificate says.
        """
        return [
            f"Reference standard {standard.row.label}, which was used on these days, was found bad from "
            f"{_days_text(finding)}. Ask the laboratory before you rely on the certificate."
            for standard, finding in self._touching(recordings)
        ]

    def _touching(self, recordings: Sequence[int]) -> list[tuple[RegisteredStandard, StandardFinding]]:
        if not self.bad:
            return []
        rows = [self.store.recordings.get(number) for number in recordings]
        return [
            (standard, finding)
            for standard, finding in self.bad
            if any(
                uses(row, standard) and overlaps(*self._performed(row), finding.bad_from, finding.bad_until)
                for row in rows
            )
        ]

    def _performed(self, row: RecordingRow) -> Days:
        if row.id not in self._days:
            self._days[row.id] = performed(self.store, row)
        return self._days[row.id]


def finding_text(standard: RegisteredStandard, finding: StandardFinding) -> str:
    """Return a finding in one sentence."""
    return (
        f"standard {standard.row.label} was found bad from {_days_text(finding)} ({finding.reason}; {finding.by}, "
        f"{finding.at:%Y-%m-%d})"
    )


def _days_text(finding: StandardFinding) -> str:
    return f"{finding.bad_from} until {finding.bad_until or 'now'}"
