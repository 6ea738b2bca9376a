"""A page of a few lines at the service's address while no web process answers there: what runs, and one button.

It needs neither the database nor the libraries of the service. What it is asked for it does by the stop path; any other
request is answered with 503, so that an open page of the service knows that the service does not answer.
"""

from __future__ import annotations

import contextlib
import hashlib
import hmac
import json
import re
import select
import socket
import threading
from collections.abc import Callable
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler
from io import BufferedReader, BytesIO
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl

from instruments.clock import SystemClock
from labctl.stop.latch import StopRequest
from labctl.stop.page_html import not_stopped, running, stopped
from labctl.stop.wire import LAST, Stopping, Word, phases

#: A request that is not read, or an answer that is not taken, within this is dropped, s.
PATIENCE_S = 5.0
#: A stop is answered after this at the latest, with how far it is, s.
ANSWER_S = 4.0
MAX_CALLERS = 32
#: Requests that wait for the web process, and for how long, s.
MAX_WAITING, WAITS_S = 200, 60.0
#: A web process that was only late is back within this, s.
WEB_BACK_S = 1.0
BODY_BYTES = 16 * 1024
STOP_PATH = re.compile(r"/api/(?:stop|campaigns/(\d+)/abort)")
OPERATORS = frozenset({"operator", "approver"})
NOT_STOPPED = "NOT STOPPED"
NO_WEB = "the web process of labctl does not answer; only a stop is possible at this address now"


@dataclass(frozen=True)
class BenchNow:
    """What the page shows of the bench."""

    text: str  #: one sentence
    runs: bool = False  #: whether a campaign runs
    not_stopped: str = ""  #: what is known of a stop that is late; empty: none is


@dataclass(frozen=True)
class PageAccess:
    """Who may stop: on loopback this machine's users, elsewhere those with an operator's key."""

    hosts: frozenset[str] = frozenset()  #: names of this service; asked of callers without a key
    keys: Path | None = None  #: file of the keys' digests; None: no key is asked for


def write_keys(path: Path, keys: dict[str, tuple[str, str]]) -> None:
    """Write digest -> (name, role) of the keys in force for a process that has no database. Raises OSError."""
    new_file = path.with_suffix(".new")
    new_file.touch(mode=0o600)
    new_file.write_text(json.dumps(keys), encoding="ascii")
    new_file.replace(path)


class StopPage:
    """Answers at a listening socket that another process uses too, between `start` and `close`."""

    def __init__(
        self,
        listener: socket.socket,
        access: PageAccess,
        respond: Callable[[StopRequest], Stopping],
        describe: Callable[[], BenchNow],
        *,
        relays: bool = False,
    ) -> None:
        """Answer with what `describe` says of the bench; a stop begins with `respond`.

        With `relays` a web process will answer here again: a request that is no stop waits for `close`, and is then
        passed on; a stop is carried out at once, and answered here if that takes longer than `WEB_BACK_S`.
        """
        self._listener, self._access, self._respond, self._describe = listener, access, respond, describe
        self._relays, self._closed = relays, threading.Event()
        self._last: Stopping | None = None  # the stop that was asked for here last
        self._waker, self._woken = socket.socketpair()
        self._callers = threading.Semaphore(MAX_CALLERS)
        self._waiting = threading.Semaphore(MAX_WAITING)
        self._thread = threading.Thread(target=self._accept, name="stop-page", daemon=True)

    def start(self) -> None:
        """Answer from now on."""
        self._listener.setblocking(False)
        self._thread.start()

    def close(self) -> None:
        """Accept no further request; those that are being answered are answered."""
        self._waker.send(b"!")
        if self._thread.is_alive():
            self._thread.join()
        self._closed.set()
        self._waker.close()
        self._woken.close()

    def _accept(self) -> None:
        while True:
            ready, _, _ = select.select([self._listener, self._woken], [], [])
            if self._woken in ready:
                return
            with contextlib.suppress(OSError):  # another process was quicker, or the caller has gone
                caller, address = self._listener.accept()
                if not self._callers.acquire(blocking=False):
                    caller.close()
                    continue
                threading.Thread(target=self._serve, args=(caller, address), name="stop-caller", daemon=True).start()

    def _serve(self, caller: socket.socket, address: Any) -> None:
        with caller, contextlib.suppress(OSError, ValueError):
            try:
                caller.settimeout(PATIENCE_S)
                request = _peeked(caller)
                is_stop = request.startswith(b"POST /api/stop") or (
                    request.startswith(b"POST /api/campaigns/") and b"/abort" in request.partition(b"\r\n")[0]
                )
                relayed = self._relays and not is_stop
                if relayed and b"\r\n\r\n" not in request:
                    return  # a head that does not end is not passed on
                if not relayed:
                    relayed = not self._answer(caller, address, request)
            finally:
                self._callers.release()
            if relayed:
                self._pass_on(caller)

    def _answer(self, caller: socket.socket, address: Any, request: bytes) -> bool:
        """Answer a request; returns False where the web process is back and answers it itself."""
        page = self

        class Handler(_Handler):
            access, respond, describe = page._access, staticmethod(page._begin), staticmethod(page._describe)
            content = request

            @property
            def last(self) -> Stopping | None:
                return page._last

            def web_is_back(self) -> bool:
                return page._relays and page._closed.wait(WEB_BACK_S)

        try:
            Handler(caller, address, None)  # type: ignore[arg-type]  # it asks its server for nothing
        except _WebIsBack:
            return False
        caller.recv(len(request))  # what is left unread would reset the connection before the answer is read
        return True

    def _begin(self, stop: StopRequest) -> Stopping:
        self._last = stopping = self._respond(stop)
        return stopping

    def _pass_on(self, caller: socket.socket) -> None:
        """Pass a connection on to the web process, once that answers again."""
        if not self._waiting.acquire(blocking=False):
            return
        try:
            if self._closed.wait(WAITS_S):
                caller.settimeout(None)
                with socket.create_connection(self._listener.getsockname()[:2], PATIENCE_S) as web:
                    web.settimeout(None)
                    back = threading.Thread(target=_copy, args=(web, caller), name="relay", daemon=True)
                    back.start()
                    _copy(caller, web)
                    back.join()
        finally:
            self._waiting.release()


class _WebIsBack(Exception):
    """The web process answers this request itself."""


def _peeked(caller: socket.socket) -> bytes:
    """Return the head of a request and its body, as far as it is short, and leave it in the socket."""
    clock = SystemClock()
    until_s = clock.now_s() + PATIENCE_S
    while True:
        content = caller.recv(BODY_BYTES, socket.MSG_PEEK)
        head, end, body = content.partition(b"\r\n\r\n")
        length = re.search(rb"\r\ncontent-length: *(\d+)", head, re.IGNORECASE)
        wanted = int(length[1]) if length else 0
        if not content or len(content) >= BODY_BYTES or (end and len(body) >= min(wanted, BODY_BYTES)):
            return content
        if clock.now_s() > until_s:
            raise TimeoutError("the request does not come to its end")
        clock.sleep(0.01)


def _copy(source: socket.socket, target: socket.socket) -> None:
    """Copy bytes until a side has ended."""
    with contextlib.suppress(OSError):
        while data := source.recv(65536):
            target.sendall(data)
    with contextlib.suppress(OSError):
        target.shutdown(socket.SHUT_WR)


class _Handler(BaseHTTPRequestHandler):
    """One request."""

    protocol_version = "HTTP/1.0"  # a connection carries one request: the next one may be the web process's
    access: PageAccess
    respond: Callable[[StopRequest], Stopping]
    describe: Callable[[], BenchNow]
    content: bytes  #: the request, which is still in the socket

    @property
    def last(self) -> Stopping | None:
        """The stop that was asked for here last."""
        return None

    def setup(self) -> None:
        """Read the request from memory."""
        super().setup()
        self.rfile = BufferedReader(BytesIO(self.content))

    def web_is_back(self) -> bool:
        """Wait a moment for the web process; returns whether it answers again."""
        return False

    def do_GET(self) -> None:
        """Show the page; anything else than a page is answered with 503."""
        if self.path.startswith(("/api", "/health", "/metrics", "/static")):
            self._problem(503, "no-web-process", f"{NO_WEB}. {self.describe().text}")
        elif self._is_ours():
            self._show(503, self._state())

    def _state(self) -> str:
        """Return the page: what the last stop here came to, else what runs."""
        asks_for_key, now, last = self.access.keys is not None, self.describe(), self.last
        if now.not_stopped:
            return not_stopped(now.not_stopped, asks_for_key)
        if last is not None and not (last.is_over(0.0) and last.stands):
            return not_stopped(last.text, asks_for_key)
        if last is not None and not now.runs:
            return stopped(f"{last.text}. {now.text}", asks_for_key)
        return running(now.text, asks_for_key)

    def do_HEAD(self) -> None:
        """Answer as `do_GET`, without the content."""
        self.do_GET()

    def do_POST(self) -> None:
        """Stop what runs, or one campaign."""
        body = self.rfile.read(min(int(self.headers.get("Content-Length") or 0), BODY_BYTES))
        match = STOP_PATH.fullmatch(self.path.partition("?")[0])
        if match is None:
            self._problem(503, "no-web-process", f"{NO_WEB}. {self.describe().text}")
            return
        fields = _fields(body, self.headers.get("Content-Type", ""))
        caller = self._caller(str(fields.get("key", "")))
        if caller is None:
            return
        by = str(fields.get("by") or caller)
        campaign = int(match[1]) if match[1] else None
        reason = f"{fields.get('reason') or 'stopped on the page'} ({by})"
        stop = StopRequest.new(by, "stop page", reason, campaign)
        last = _followed(self.respond(stop))
        if last.phase == "stands" and self.web_is_back():
            raise _WebIsBack
        self._tell(last)

    @property
    def _wants_page(self) -> bool:
        return "text/html" in self.headers.get("Accept", "")

    def _tell(self, last: Word) -> None:
        stands = last.phase == "stands"
        if self._wants_page:
            page = stopped if stands else not_stopped
            self._show(200 if stands else 503, page(last.text, self.access.keys is not None))
        elif stands:
            answer = {"stands": True, "text": last.text, "campaign": last.campaign}
            self._send(200, "application/json", json.dumps(answer).encode())
        else:
            self._problem(503, "not-stopped", f"{NOT_STOPPED}: {last.text}. Use the stop switch of the bench.")

    def _is_ours(self) -> bool:
        """Return whether a request without a key was sent to this service by a name of it, by no other site."""
        if self.access.keys is not None:
            return True
        host = self.headers.get("Host", "")
        name = host.rpartition(":")[0] if host.rpartition(":")[2].isdigit() else host
        origin = self.headers.get("Origin")
        site = self.headers.get("Sec-Fetch-Site", "none")
        reads = self.command in {"GET", "HEAD"}
        if name.lower() in self.access.hosts and (
            reads or (site in {"none", "same-origin"} and origin in {None, "null", f"http://{host}", f"https://{host}"})
        ):
            return True
        self._problem(403, "not-allowed", "the request came from another site, or by another name of this computer")
        return False

    def _caller(self, form_key: str) -> str | None:
        """Return who asks; None where the request was refused, which is then answered."""
        if self.access.keys is None:
            return (self.headers.get("Labctl-User") or "local")[:100] if self._is_ours() else None
        scheme, _, key = (self.headers.get("Authorization") or f"Bearer {form_key}").partition(" ")
        digest = hashlib.sha256(key.strip().encode("utf-8", "surrogatepass")).hexdigest()
        try:
            known = json.loads(self.access.keys.read_bytes())
        except (OSError, ValueError):
            known = {}
        for each, (name, role) in known.items():
            if scheme.lower() == "bearer" and hmac.compare_digest(each, digest) and role in OPERATORS:
                return str(name)
        if self._wants_page:
            self._show(401, not_stopped("This is not an operator's key. Only an operator's key stops the bench.", True))
        else:
            text = "a stop at this address needs an operator's key: Authorization: Bearer KEY"
            self._problem(401, "not-identified", text)
        return None

    def _problem(self, status: int, slug: str, detail: str) -> None:
        problem = {"type": f"urn:labctl:problem:{slug}", "title": slug, "status": status, "detail": detail}
        self._send(status, "application/problem+json", json.dumps(problem).encode())

    def _show(self, status: int, page: str) -> None:
        self._send(status, "text/html; charset=utf-8", page.encode())

    def _send(self, status: int, kind: str, content: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", "default-src 'none'; style-src 'unsafe-inline'; form-action 'self'")
        if status == 503:
            self.send_header("Retry-After", "1")
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(content)

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002  the name in the base class
        """Log nothing: standard error is the log of the process, which has a form of its own."""


def _followed(stopping: Stopping) -> Word:
    """Follow a stop for as long as a caller waits; returns the last that is known."""
    last = Word("asked", stopping.text, stopping.campaign)
    words: list[Word] = []
    over = threading.Event()

    def follow() -> None:
        for word in phases(stopping):
            words.append(word)
            if word.phase in LAST:
                break
        over.set()

    threading.Thread(target=follow, name="stop-follow", daemon=True).start()
    over.wait(ANSWER_S)
    return words[-1] if words else last


def _fields(body: bytes, kind: str) -> dict[str, Any]:
    """Return what was given as JSON, or in the form of the page; nothing where it cannot be read."""
    try:
        if "urlencoded" in kind:
            return dict(parse_qsl(body.decode(), max_num_fields=10))
        document = json.loads(body or b"{}") if "json" in kind else {}
    except ValueError:
        return {}
    return document if isinstance(document, dict) else {}
