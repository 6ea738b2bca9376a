"""A recording in memory, and the interchange format it is read from and written to."""

from labctl.recording.info import OutputUnit, RecordingInfo
from labctl.recording.recording import Recording

__all__ = ["OutputUnit", "Recording", "RecordingInfo"]
