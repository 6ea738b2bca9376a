"""Answers that depend on a recording alone: a client that has one gets 304, and nothing is read or computed for it."""

from __future__ import annotations

from fastapi import Depends, Request, Response

from labctl.api.dependencies import ServiceDep
from labctl.api.validators import REVALIDATED, is_known, weak_tag
from labctl.services.cache import code_digest


class NotModified(Exception):
    """The client has the answer that it asks for; `tag` is the ETag of it."""

    def __init__(self, tag: str) -> None:
        super().__init__(tag)
        self.tag = tag


def answer_not_modified(_: Request, error: Exception) -> Response:
    """Return status 304 without a body."""
    tag = error.tag if isinstance(error, NotModified) else ""
    return Response(status_code=304, headers={"ETag": tag, "Cache-Control": REVALIDATED})


def _tag_of_recording(request: Request, response: Response, recording: int, service: ServiceDep) -> None:
    """Give an answer the ETag of its address, of what the recording holds now and of the code that answers.

    Raises NotModified, NotFound.
    """
    holds = service.store.recordings.fingerprint(recording)
    tag = weak_tag(part.encode() for part in (request.url.path, request.url.query, holds, code_digest()))
    if is_known(tag, request.headers.get("if-none-match")):
        raise NotModified(tag)
    response.headers.update({"ETag": tag, "Cache-Control": REVALIDATED})


OF_RECORDING = Depends(_tag_of_recording)
