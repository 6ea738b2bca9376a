"""Checks of single readings: what is wrong with some rows of a recording, or with one channel."""

from labctl.recording.sanity.readings.examination import Examination, examination, examine, joined_examinations
from labctl.recording.sanity.readings.leaving_out import MAY_BE_LEFT_OUT, without
from labctl.recording.sanity.readings.series import Marked

__all__ = [
    "MAY_BE_LEFT_OUT",
    "Examination",
    "Marked",
    "examination",
    "examine",
    "joined_examinations",
    "without",
]
