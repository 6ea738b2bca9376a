"""Recordings as a fit takes them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labctl.errors import NotEnoughData, NotFound
from labctl.recording import Recording
from labctl.recording.output_steps import per_reading
from labctl.recording.points import with_pieces
from labctl.recording.quantisation import QUANTISATION
from labctl.services.cache import UNNAMED, compute
from labctl.services.recordings.inspection import inspect_stored
from labctl.services.schemas.warnings import RecordingInspection
from labctl.store import RecordingRow, Store


def points_of(store: Store, row: RecordingRow) -> Recording:
    """Return a recording's means as a fit takes them: a long data set through which the temperature moved in pieces.

    Where the rate changes within data sets (motion "profile") every reading is returned: a fit needs the rate of each.
    """
    if is_profile(row):
        return store.recordings.samples(row.id)
    points = store.recordings.points(row.id, head=row)
    if row.kind != "samples":
        return points

    def readings(dataset: int) -> Mapping[str, NDArray[np.generic]]:
        compute(UNNAMED)
        return store.recordings.dataset(row.id, dataset)

    pieces = with_pieces(points, readings)
    return _with_steps(pieces, inspect_stored(store, row))


def is_profile(row: RecordingRow) -> bool:
    """Return whether a recording holds readings whose rate changes within data sets."""
    return row.kind == "samples" and row.info.get("motion") == "profile"


def _with_steps(points: Recording, found: RecordingInspection) -> Recording:
    """Return means with a column for what coarse steps of an output leave in them, where they do."""
    if not found.quantisation_dps:
        return points
    columns = dict(points.columns)
    numbers, dataset = np.asarray(found.dataset), np.asarray(columns["dataset"], dtype=np.int64)
    for axis, u_dps in found.quantisation_dps.items():
        unit = next((unit for name, unit in points.info.output.items() if name == axis), None)
        scale = abs(unit.scale) if unit else 1.0
        columns[f"gyro_{axis}{QUANTISATION}"] = per_reading(dataset, numbers, scale * np.asarray(u_dps))
    return replace(points, columns=columns)


def newest_row(store: Store, serial: str, recording: int | None, *, other_unit: bool = False) -> RecordingRow:
    """Return the recording asked for, or the unit's newest in which something was measured.

    It must be a recording of the unit, unless `other_unit`. Raises NotFound, NotEnoughData where no data set is
    complete yet.
    """
    store.units.get(serial)
    rows = store.recordings.of_unit(serial) if recording is None else [store.recordings.get(recording)]
    if not rows:
        raise NotFound(f"unit {serial!r} has no recording; `labctl import DIR` or a campaign creates one")
    row = next((row for row in rows if _measured(row)), rows[0])
    if row.serial != serial and not other_unit:
        raise NotFound(
            f"recording {recording} is of unit {row.serial!r}, not of {serial!r}; name another, or give --other-unit"
        )
    if not _measured(row):
        raise NotEnoughData(
            f"recording {row.id} of unit {serial!r} holds no complete data set yet; wait for its first, or name another"
        )
    return row


def _measured(row: RecordingRow) -> bool:
    return row.kind != "samples" or row.datasets > 0
