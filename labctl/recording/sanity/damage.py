"""What of the file of a recording could not be read, as a finding of every answer about the recording."""

from __future__ import annotations

from collections.abc import Iterator

from labctl.recording.info import RecordingInfo
from labctl.recording.sanity.finding import Finding
from labctl.recording.unread import TAKE_AGAIN


def check_damage(info: RecordingInfo) -> Iterator[Finding]:
    """Yield what was lost where the file was damaged or cut off."""
    if info.unread:
        percent = None if info.unread_share is None else 100 * info.unread_share
        yield Finding("unread", "likely", "file", info.unread, percent, "%", "a file that is whole", TAKE_AGAIN)
