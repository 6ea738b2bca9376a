"""Recordings: listed, and imported from a folder."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

from labctl.answers.recording_head import RecordingKind
from labctl.answers.recordings import ImportResponse, RecordingResponse
from labctl.client.connection import ClientPart
from labctl.recording.files import recording_parts
from labctl.service_connection import json_of, query_string


class RecordingMethods(ClientPart):
    """Requests about recordings."""

    def recordings(
        self, *, unit: str | None = None, kind: RecordingKind | None = None, search: str = "", limit: int | None = None
    ) -> list[RecordingResponse]:
        """Return every recording, newest first, or those of one `unit` or `kind`; at most `limit`.

        With `search` those whose serial number or notes hold it.
        """
        query = query_string(unit=unit, kind=kind, search=search, limit=limit)
        return self._connection.get_list(f"/api/recordings{query}", RecordingResponse)

    def import_recording(self, folder: Path | str) -> ImportResponse:
        """Send the recording in `folder` (interchange format) and return its number and the warnings about it.

        Raises BadRecording for a folder without a recording.
        """
        with ExitStack() as opened:
            files = recording_parts(opened, Path(folder))
            response = self._connection.request("POST", "/api/recordings", files=files)
        return ImportResponse.model_validate(json_of(response))
