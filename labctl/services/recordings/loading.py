"""Recordings as a fit takes them."""

from __future__ import annotations

from labctl.errors import NotEnoughData, NotFound
from labctl.recording import Recording
from labctl.recording.points import with_pieces
from labctl.store import RecordingRow, Store


def points_of(store: Store, row: RecordingRow) -> Recording:
    """Return a recording's means as a fit takes them: a long data set through which the temperature moved in pieces."""
    points = store.recordings.points(row.id, head=row)
    if row.kind != "samples":
        return points
    return with_pieces(points, lambda dataset: store.recordings.dataset(row.id, dataset))


def newest_row(store: Store, serial: str, recording: int | None, *, other_unit: bool = False) -> RecordingRow:
    """Return the recording asked for, or the unit's newest in which something was measured.

    It must be a recording of the unit, unless `other_unit`. Raises NotFound, NotEnoughData where no data set is
    complete yet.
    """
    store.units.get(serial)
    rows = store.recordings.of_unit(serial) if recording is None else [store.recordings.get(recording)]
    if not rows:
        raise NotFound(f"unit {serial!r} has no recording; `labctl import DIR` or a campaign makes one")
    row = next((row for row in rows if _measured(row)), rows[0])
    if row.serial != serial and not other_unit:
        raise NotFound(f"recording {recording} is of unit {row.serial!r}, not of {serial!r}")
    if not _measured(row):
        raise NotEnoughData(
            f"recording {row.id} of unit {serial!r} holds no complete data set yet; wait for its first, or name another"
        )
    return row


def _measured(row: RecordingRow) -> bool:
    return row.kind != "samples" or row.datasets > 0
