"""Readings that are left out by choice: marked as bad with what, how many and why, and kept in the recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from labctl.answers.recording_head import LeftOut
from labctl.errors import BadInput
from labctl.recording.recording import Recording
from labctl.recording.sanity.readings.examination import examine

#: Kinds of findings whose readings can be left out.
MAY_BE_LEFT_OUT = ("frozen", "clipped", "thermometer", "spikes", "repeated", "moved", "noise_changes", "shifted")
ALL = "all"


def without(recording: Recording, kinds: Sequence[str], name: str) -> Recording:
    """Return a recording whose readings of some kinds of findings are marked with valid = 0; `name` is its file's.

    What is left out is stated in `left_out` of its head. Nothing is removed: the readings stay as they were measured.
    Raises BadInput for readings that cannot be left out, and where no reading would stay.
    """
    faults = [each for each in examine(recording) if ALL in kinds or each.finding.what in kinds]
    chosen_faults = [fault for fault in faults if fault.finding.may_leave_out]
    if refused := [
        fault.finding for fault in faults if not fault.finding.may_leave_out and fault.finding.what in kinds
    ]:
        raise BadInput(f"{name}: {refused[0].where}: cannot be left out: {refused[0].said}; {refused[0].do}")
    if not chosen_faults:
        return recording
    n = len(recording)
    valid = np.asarray(recording.columns["valid"]) != 0 if "valid" in recording.columns else np.ones(n, dtype=bool)
    left_out: list[LeftOut] = []
    for each in chosen_faults:
        rows = each.rows & valid
        valid &= ~each.rows
        left_out.append(
            LeftOut(
                what=each.finding.what, channel=each.finding.channel, n=int(rows.sum()), of=n, why=each.finding.said
            )
        )
    if not valid.any():
        raise BadInput(f"{name}: no reading would be left without those of {', '.join(kinds)}; measure again")
    info = recording.info.model_copy(update={"left_out": (*recording.info.left_out, *left_out)})
    return replace(recording, info=info, columns={**recording.columns, "valid": valid.astype(np.int64)})
