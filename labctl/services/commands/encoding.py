"""How the request of a command is sent over HTTP, as keyword arguments of `httpx.Client.request`."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack

from labctl.answers.base import Request
from labctl.recording.column_map import map_text
from labctl.recording.files import recording_parts
from labctl.services.commands.requests import LogFile, RecordingFolder


def json_body(_: ExitStack, request: object) -> Mapping[str, object]:
    """Send the request, or the body of an addressed one, as JSON; what was not set is left to the service."""
    body = getattr(request, "body", request)
    if not isinstance(body, Request):
        return {}
    return {"json": body.model_dump(mode="json", exclude_unset=True)}


def log_file(opened: ExitStack, request: LogFile) -> Mapping[str, object]:
    """Send a log with its map as one form."""
    content = opened.enter_context(request.path.open("rb"))
    fields: dict[str, object] = {
        "column_map": "" if request.column_map is None else map_text(request.column_map),
        "importer": request.importer or "",
        "option": list(request.options),
        "leave_out": list(request.leave_out),
    }
    return {"files": [("file", (request.path.name, content))], "data": fields}


def recording_files(opened: ExitStack, request: RecordingFolder) -> Mapping[str, object]:
    """Send the files of a recording as parts of one form. Raises BadRecording for a folder without any."""
    return {"files": recording_parts(opened, request.folder), "data": {"leave_out": list(request.leave_out)}}
