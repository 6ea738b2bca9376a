"""Rows of a log that are out of order in time, left out by choice or for an inspection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from labctl.answers.recording_head import LeftOut
from labctl.errors import BadInput
from labctl.recording import Recording
from labctl.recording.column_map import ColumnMap
from labctl.recording.column_map.time_order import in_order_of_time
from labctl.recording.raw_table import RawTable
from labctl.recording.sanity import Finding
from labctl.recording.sanity.readings.leaving_out import ALL, MAY_BE_LEFT_OUT

#: The kind of finding whose rows are left out before a log is made a recording: such rows have no place in one.
OUT_OF_ORDER = "time_back"


def refuse_unknown(kinds: Sequence[str]) -> None:
    """Raise BadInput for a kind of finding whose readings cannot be left out."""
    kinds_known = (OUT_OF_ORDER, *MAY_BE_LEFT_OUT, ALL)
    if unknown := [kind for kind in kinds if kind not in kinds_known]:
        raise BadInput(
            f"--leave-out {unknown[0][:60]}: readings of this kind cannot be left out; choose from "
            f"{', '.join(kinds_known[:-1])} or {ALL}"
        )


def leaves_out_rows(kinds: Sequence[str]) -> bool:
    """Whether the rows that are out of order are to be left out."""
    return OUT_OF_ORDER in kinds or ALL in kinds


@dataclass
class OutOfOrder:
    """Leaves out the rows of a log whose time goes back, and keeps the finding about them.

    Where the clock was set back the readings themselves are in order; then nothing is left out, unless `also_steps`.
    """

    also_steps: bool = False
    findings: list[Finding] = field(default_factory=list)

    def rows_in_order(self, table: RawTable, column_map: ColumnMap) -> RawTable:
        """Return the log without those rows."""
        in_order, problem = in_order_of_time(table, column_map)
        if problem is None or not (problem.may_leave_out or self.also_steps):
            return table
        self.findings.append(problem)
        return in_order

    def stated(self, recording: Recording, rows: int) -> Recording:
        """Return a recording whose head states what was left out of the log's rows."""
        left_out = tuple(
            LeftOut(what=finding.what, channel=finding.channel, n=finding.n or 0, of=rows, why=finding.said)
            for finding in self.findings
        )
        if not left_out or self.also_steps:  # an inspection leaves nothing out of what is kept
            return recording
        info = recording.info.model_copy(update={"left_out": (*recording.info.left_out, *left_out)})
        return replace(recording, info=info)
