"""Error ladder: the versions of a unit on one recording, each after its parent, down to the noise floor."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from labctl.answers.ladder import LadderResponse, LadderRow
from labctl.errors import BadInput, LabctlError
from labctl.services.cache import UNNAMED, compute
from labctl.services.criticism.versions import version_of
from labctl.store import CalibrationRecord, RecordingRow, Store

#: Applying more versions than this to a recording takes long.
QUICK_VERSIONS = 4


def ladder(store: Store, serial: str, recording: int | None = None) -> LadderResponse:
    """Return the versions fitted to a recording (default: that of the newest version), each after its parent.

    Versions of other recordings stand apart, with their error when they are applied to this recording as they are;
    versions fitted to several recordings together have this error too where there are others.
    Raises NotFound, BadInput where the unit has no version of this recording.
    """
    rows = sorted(store.calibrations.of_unit(store.units.get(serial).serial), key=lambda row: row.version)
    newest_version = version_of(store, serial, None)
    chosen: int | None = recording
    together: Sequence[int | None] = (recording,)
    if recording is None:
        chosen, together = newest_version.recording, newest_version.recordings
    on_recording = [row for row in rows if _is_of(row, chosen, together)]
    if not on_recording:
        fitted = sorted({row.recording for row in rows if row.recording is not None})
        raise BadInput(
            f"no version of {serial} was fitted to recording {recording} (the unit's versions were fitted to "
            f"recordings {', '.join(map(str, fitted)) or 'none'}); `labctl fit {serial} --recording "
            f"{recording}` makes a version"
        )
    others = [row for row in rows if not _is_of(row, chosen, together)]
    applied = _applied_here(
        store, [*(row for row in on_recording if others and len(row.recordings) > 1), *others], chosen
    )
    steps = [_step(row, applied.get(row.version)) for row in _by_parentage(on_recording)]
    newest = max(steps, key=lambda step: step.version)
    return LadderResponse(
        serial=serial,
        recording=chosen,
        recordings=list(on_recording[0].recordings),
        steps=steps,
        others=[_step(row, applied.get(row.version)) for row in others],
        noise_floor_dps=newest.noise_floor_dps,
    )


def _is_of(row: CalibrationRecord, recording: int | None, together: Sequence[int | None]) -> bool:
    """Return whether a version was fitted to exactly these recordings."""
    return row.recording == recording and (recording is None or tuple(row.recordings) == tuple(together))


def _by_parentage(rows: Sequence[CalibrationRecord]) -> Iterator[CalibrationRecord]:
    """Yield versions depth first: each after its parent, a parent's newer children after its older ones."""
    numbers = {row.version for row in rows}
    children: dict[int | None, list[CalibrationRecord]] = {}
    for row in rows:
        children.setdefault(row.parent if row.parent in numbers else None, []).append(row)

    def below(parent: int | None) -> Iterator[CalibrationRecord]:
        for row in children.get(parent, []):
            yield row
            yield from below(row.version)

    return below(None)


def _step(row: CalibrationRecord, applied_rms_dps: float | None = None) -> LadderRow:
    error = row.answer["error"]
    return LadderRow(
        version=row.version,
        parent=row.parent,
        recording=row.recording,
        recordings=list(row.recordings),
        model=row.model,
        effects=list(row.answer["model"]["effects"]),
        applied_rms_dps=applied_rms_dps,
        raw_rms_dps=error["raw_rms_dps"],
        rms_dps=error["rms_dps"],
        heldout_rms_dps=error["heldout_rms_dps"],
        noise_floor_dps=error["noise_floor_dps"],
    )


def _applied_here(
    store: Store, versions: Sequence[CalibrationRecord], recording: int | None
) -> dict[int, float | None]:
    """Return version -> its error on this recording without refitting, deg/s (None where it cannot be applied)."""
    if not versions or recording is None:
        return {}
    if len(versions) > QUICK_VERSIONS:
        compute(UNNAMED)
    from labctl.services.criticism.measurements import Measurements  # noqa: PLC0415  loads the fit's libraries
    from labctl.services.criticism.verification.of_version import left_by  # noqa: PLC0415  as above

    head: RecordingRow = store.recordings.get(recording)
    measured = Measurements(store, (head,))

    def applied(row: CalibrationRecord) -> float | None:
        try:
            return left_by(store, row, measured).rms_dps
        except LabctlError:
            return None

    return {row.version: applied(row) for row in versions}
