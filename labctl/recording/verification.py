"""The two parts of a recording: what a fit takes in, and what was measured to verify a calibration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.recording.columns import VERIFICATION
from labctl.recording.recording import Recording


def is_marked(recording: Recording) -> NDArray[np.bool_]:
    """Return which rows were measured to verify a calibration, (n,)."""
    if VERIFICATION not in recording.columns:
        return np.zeros(len(recording), dtype=np.bool_)
    return np.asarray(recording.columns[VERIFICATION]) != 0


def fitted_part(recording: Recording) -> Recording:
    """Return the rows that a fit takes in; the recording itself where nothing was measured to verify.

    Raises NotEnoughData where all of it was.
    """
    if VERIFICATION not in recording.columns:
        return recording
    marked = is_marked(recording)
    if len(marked) and marked.all():
        raise NotEnoughData(
            f"{recording.info.serial}: every data set of this recording was measured to verify a calibration (column "
            f"{VERIFICATION!r} is 1), and such data are never fitted; name another recording"
        )
    return _rows(recording, ~marked)


def verification_part(recording: Recording) -> Recording | None:
    """Return the rows that were measured to verify a calibration; None where there are none."""
    marked = is_marked(recording)
    return _rows(recording, marked) if marked.any() else None


def _rows(recording: Recording, is_used: NDArray[np.bool_]) -> Recording:
    columns = {name: values[is_used] for name, values in recording.columns.items() if name != VERIFICATION}
    return replace(recording, columns=columns)
