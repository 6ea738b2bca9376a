"""Checks of single readings: what is wrong with some rows of a recording, or with one channel."""

from labctl.recording.sanity.readings.examination import examine
from labctl.recording.sanity.readings.series import Marked

__all__ = ["Marked", "examine"]
