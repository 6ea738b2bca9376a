"""Answers that a browser has already are not sent again: each JSON document that is read has an ETag of its content.

The answer is made for each request, so none is ever out of date; 304 without a body says that it is the same as before
(RFC 9110, 13.1.2). The tag is weak, because the same document travels in several codings.
"""

from __future__ import annotations

from collections.abc import Iterable
from hashlib import sha256

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from labctl.api.access_policy import API
from labctl.api.paging import TOTAL

#: Kept by a browser, and asked for again each time before it is used.
REVALIDATED = "no-cache"
READING = frozenset({"GET", "HEAD"})
#: Headers that are part of an answer: how many rows there are, and where the next are.
ANSWERING = (TOTAL, "Link")
#: Of the body, in an answer without one.
OF_THE_BODY = ("content-type", "content-length")


def weak_tag(parts: Iterable[bytes]) -> str:
    """Return the weak ETag of a content in parts."""
    digest = sha256()
    for part in parts:
        digest.update(part)
    return f'W/"{digest.hexdigest()[:32]}"'


def is_known(tag: str, if_none_match: str | None) -> bool:
    """Return whether a client names a tag as what it has, by weak comparison (RFC 9110, 8.8.3.2)."""
    known = {each.strip().removeprefix("W/") for each in (if_none_match or "").split(",")}
    return "*" in known or tag.removeprefix("W/") in known


class ValidatorMiddleware:
    """Gives each JSON document of the API an ETag, and answers 304 where the client has the document.

    Files with an ETag of their own, such as a calibration, and streams pass as they are.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] == "http" and scope["method"] in READING and scope["path"].startswith(API):
            known = Headers(scope=scope).get("if-none-match")
            await self._app(scope, receive, _Answer(send, known).send)
        else:
            await self._app(scope, receive, send)


class _Answer:
    """One answer: its head waits for its body, which says whether the client has it."""

    def __init__(self, send: Send, known: str | None) -> None:
        self._send, self._known = send, known
        self._head: Message | None = None

    async def send(self, message: Message) -> None:
        if message["type"] == "http.response.start" and _is_document(message):
            self._head = message
            return
        if self._head is None or message["type"] != "http.response.body":
            await self._send(message)
            return
        head, self._head = self._head, None
        if message.get("more_body", False):  # a stream: its end is not known yet
            await self._send(head)
        elif self._tagged(head, message.get("body", b"")):
            await self._send({**head, "status": 304})
            message = {**message, "body": b""}
        else:
            await self._send(head)
        await self._send(message)

    def _tagged(self, head: Message, body: bytes) -> bool:
        """Give an answer its tag; return whether the client has it."""
        headers = MutableHeaders(raw=head["headers"])
        tag = weak_tag([body, *(f"{name}: {headers.get(name, '')}\n".encode() for name in ANSWERING)])
        headers["ETag"], headers["Cache-Control"] = tag, headers.get("cache-control", REVALIDATED)
        held = is_known(tag, self._known)
        for name in OF_THE_BODY if held else ():
            del headers[name]
        head["headers"] = headers.raw
        return held


def _is_document(head: Message) -> bool:
    headers = Headers(raw=head["headers"])
    is_json = headers.get("content-type", "").partition(";")[0] == "application/json"
    return head["status"] == 200 and is_json and "etag" not in headers
