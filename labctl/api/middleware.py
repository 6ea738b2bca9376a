"""Access middleware: identifies every request, checks its role and bounds its body before the application reads it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from urllib.parse import unquote

from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from labctl.acting_user import Actor, acting
from labctl.answers.admin import Caller, Role
from labctl.api.access_policy import API, OPEN, PROVEN, READING, STOPS, UPLOADS, AccessPolicy, role_needed
from labctl.api.connection_limits import RESERVED
from labctl.api.problems import as_problem
from labctl.errors import BadInput, LabctlError, NotAllowed, NotIdentified, Overloaded, TooLarge
from labctl.service_connection import USER_HEADER
from labctl.services.admin.api_keys import identify, require_role
from labctl.services.admin.key_memory import KeyMemory
from labctl.services.lab_service import LabService
from labctl.web import is_page

#: Uploads at once: while one comes, each of its files is a file here.
MAX_UPLOADS = 8


class AccessMiddleware:
    """Wraps the application; a refused request never reaches it."""

    def __init__(self, app: ASGIApp, service: LabService, access: AccessPolicy, keys: KeyMemory | None = None) -> None:
        """`keys` are the keys in force from memory, for stops; None: every key is looked up in the database."""
        self._app = app
        self._keys = keys
        self._service = service
        self._access = access
        self._uploads = 0
        self._held = _Held(access.held_bytes)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it with a problem document."""
        if scope["type"] == "websocket":  # nothing here speaks it, and no key would be asked for
            await send({"type": "websocket.close", "code": 1008})
            return
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        try:
            caller = await self._admit(scope)
            uploads = self._refuse_crowd(scope)
            largest = self._access.largest_body(scope["path"])
            body = _BoundedBody(receive, _declared(scope), largest, None if uploads else self._held)
        except LabctlError as error:
            await as_problem(error, scope["path"])(scope, receive, send)
            return
        scope.setdefault("state", {})["caller"] = caller
        self._uploads += uploads
        try:
            with acting(Actor(caller.name, caller.via) if caller else Actor("nobody")):
                await self._app(scope, body, send)
        finally:
            self._uploads -= uploads
            body.release()

    def _refuse_crowd(self, scope: Scope) -> bool:
        """Return whether a request uploads files. Raises Overloaded where it has to wait for others.

        A connection of the reserve is kept for an admitted request that acts, and for `/health`.
        """
        reads = role_needed(scope["method"], scope["path"]) is Role.VIEWER
        if scope.get("state", {}).get(RESERVED) and reads and scope["path"] not in OPEN:
            raise Overloaded(
                "the limit of connections that this service answers at once is reached; try again in a few seconds"
            )
        uploads = bool(scope["path"] in UPLOADS and not reads)
        if uploads and self._uploads >= MAX_UPLOADS:
            raise Overloaded(
                f"{MAX_UPLOADS} recordings are being received already, the limit of this service; send this "
                "recording again when one of the others is complete"
            )
        return uploads

    async def _admit(self, scope: Scope) -> Caller | None:
        """Return the caller; None at a path that is open without a key.

        Raises NotIdentified, NotAllowed, ReadOnly, BadInput.
        """
        if "\x00" in scope["path"] or b"%00" in scope["query_string"]:
            raise BadInput("the address holds a NUL character; remove it")
        try:
            caller = await self._caller(scope)
            if self._access.read_only is not None:
                self._access.read_only.refuse_act(scope["method"], scope["path"])
            require_role(caller, role_needed(scope["method"], scope["path"]))
        except NotAllowed:
            proven = scope["path"] in PROVEN and b"calibration=" in scope["query_string"]
            if (scope["path"] in OPEN or proven or is_page(scope["path"])) and scope["method"] in READING:
                return None
            raise
        return caller

    async def _caller(self, scope: Scope) -> Caller:
        headers = _headers_of(scope)
        if (authorization := headers.get("authorization")) is not None:
            if self._keys is not None and scope["method"] == "POST" and STOPS.fullmatch(scope["path"]):
                return await self._keys.caller_of(authorization)
            return await identify(self._service.keys, authorization)
        if self._access.keys:
            raise NotIdentified(
                "this service requires an API key: send `Authorization: Bearer KEY`; `labctl key create` makes one"
            )
        self._refuse_foreign(scope, headers)
        claimed = unquote(headers.get(USER_HEADER.lower(), ""))[:100]
        return Caller(claimed if claimed.isprintable() and claimed else "local", Role.APPROVER, "loopback")

    def _refuse_foreign(self, scope: Scope, headers: Mapping[str, str]) -> None:
        """Raise NotAllowed for a request that another site or machine sent through this one.

        Reading the API is refused to another site too: it cannot see the answer, but the service is kept busy.
        Pages and `/health` answer a link from anywhere.
        """
        if self._access.hosts is None:
            return
        host = headers.get("host", "")
        if _name_of(host) not in self._access.hosts:
            raise NotAllowed(
                f"host {host!r} is not accepted; use one of these addresses: "
                f"{', '.join(sorted(self._access.hosts))}; or start the service with --require-keys"
            )
        if "forwarded" in headers or "x-forwarded-for" in headers:
            raise NotAllowed(
                "the request came through a proxy, but this service was started without --require-keys; start it with "
                "--require-keys, so that every request needs an API key"
            )
        reads = scope["method"] in READING
        if reads and not scope["path"].startswith(API):
            return
        if headers.get("sec-fetch-site", "none") not in {"none", "same-origin"}:
            raise NotAllowed(
                "pages of other sites may not send requests to this service; open the address of this service "
                "in the browser"
            )
        origin = headers.get("origin")
        if not reads and origin is not None and origin.partition("://")[2] != host:
            raise NotAllowed(
                f"a page of {origin[:80]} may not change anything in this service; open the address of this "
                "service in the browser"
            )


def _name_of(host: str) -> str:
    """Return a Host header without its port."""
    name, colon, port = host.rpartition(":")
    return (name if colon and port.isdigit() else host).lower()


def _headers_of(scope: Scope) -> dict[str, str]:
    """Return the headers of a request by their names in small letters; of one that is sent twice, the first."""
    return {name.decode("latin-1"): value.decode("latin-1") for name, value in reversed(scope["headers"])}


def _declared(scope: Scope) -> int:
    text = next((value.decode("latin-1") for name, value in scope["headers"] if name == b"content-length"), "0")
    return int(text) if text.isascii() and text.isdigit() else 0


@dataclass
class _Held:
    """Bytes of bodies in memory, and how many there may be."""

    limit: int
    now: int = 0


class _BoundedBody:
    """A `receive` that passes on at most `limit` bytes of body, counted among what is `held` until it is released.

    Without `held` the body goes to the disk. Raises TooLarge for a body declared larger.
    """

    def __init__(self, receive: Receive, declared: int, limit: int, held: _Held | None) -> None:
        self._receive, self._limit, self._held = receive, limit, held
        self._text = (
            f"the request's body is larger than the limit of {limit} bytes; send less, or for recordings start the "
            "service with a larger --max-upload-mib"
        )
        self._taken = 0
        if declared > limit:
            raise TooLarge(self._text)

    async def __call__(self) -> Message:
        """Return the next piece. Raises HTTPException, the one kind that passes the framework's body reader."""
        message = await self._receive()
        size = len(message.get("body", b""))
        self._taken += size
        if self._held is not None:
            self._held.now += size
        if self._taken > self._limit:
            raise HTTPException(TooLarge.status, self._text)
        if self._held is not None and size and self._held.now > self._held.limit:
            text = (
                f"requests with {self._held.limit} bytes in all are being received already, the limit of this "
                "service; send this request again in a few seconds"
            )
            raise HTTPException(Overloaded.status, text, {"Retry-After": str(Overloaded.retry_after_s)})
        return message

    def release(self) -> None:
        """Count the body as held in memory no longer."""
        if self._held is not None:
            self._held.now -= self._taken
        self._taken = 0
