"""How the request of a command is sent over HTTP, as keyword arguments of `httpx.Client.request`."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack

from labctl.errors import BadRecording
from labctl.services.commands.requests import RecordingFolder
from labctl.services.recordings.transfer import FILE_NAMES
from labctl.services.schemas.base import Request


def json_body(_: ExitStack, request: object) -> Mapping[str, object]:
    """Send the request, or the body of an addressed one, as JSON; what was not set is left to the service."""
    body = getattr(request, "body", request)
    if not isinstance(body, Request):
        return {}
    return {"json": body.model_dump(mode="json", exclude_unset=True)}


def recording_files(opened: ExitStack, request: RecordingFolder) -> Mapping[str, object]:
    """Send the files of a recording as parts of one form. Raises BadRecording for a folder without any."""
    found = [path for path in sorted(request.folder.glob("*")) if path.name in FILE_NAMES]
    files = [("files", (path.name, opened.enter_context(path.open("rb")))) for path in found]
    if not files:
        raise BadRecording(f"{request.folder}: no recording there (expected recording.toml and a data file)")
    return {"files": files}
