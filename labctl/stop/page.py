"""A page of a few lines at the service's address while no web process answers there: what runs, and one button.

It needs neither the database nor the libraries of the service. What it is asked for it does by the stop path; any other
request is answered with 503, so that an open page of the service knows that the service does not answer.
"""

from __future__ import annotations

import contextlib
import hashlib
import hmac
import html
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

from instruments.clock import SystemClock
from labctl.stop.latch import StopRequest
from labctl.stop.wire import LAST, Stopping, Word, phases

#: A request that is not read, or an answer that is not taken, within this is dropped, s.
PATIENCE_S = 5.0
#: A stop is answered after this at the latest, with how far it is, s.
ANSWER_S = 4.0
MOST_CALLERS = 32
#: Requests that wait for the web process, and for how long, s.
MOST_WAITING, WAITS_S = 200, 60.0
#: A web process that was only late is back within this, s.
WEB_BACK_S = 1.0
BODY_BYTES = 16 * 1024
STOP_PATH = re.compile(r"/api/(?:stop|campaigns/(\d+)/abort)")
OPERATORS = frozenset({"operator", "approver"})
NO_WEB = "the web process of labctl does not answer; only a stop is possible at this address now"


@dataclass(frozen=True)
class PageAccess:
    """Who may stop: on loopback this machine's users, elsewhere those with an operator's key."""

    hosts: frozenset[str] = frozenset()  #: names of this service; asked of callers without a key
    keys: Path | None = None  #: file of the keys' digests; None: no key is asked for


def write_keys(path: Path, keys: dict[str, tuple[str, str]]) -> None:
    """Write digest -> (name, role) of the keys in force for a process that has no database. Raises OSError."""
    made = path.with_suffix(".new")
    made.touch(mode=0o600)
    made.write_text(json.dumps(keys), encoding="ascii")
    made.replace(path)


class StopPage:
    """Answers at a listening socket that another process uses too, between `start` and `close`."""

    def __init__(
        self,
        listener: socket.socket,
        access: PageAccess,
        respond: Callable[[StopRequest], Stopping],
        describe: Callable[[], str],
        *,
        relays: bool = False,
    ) -> None:
        """Answer with what `describe` says of the bench; a stop begins with `respond`.

        With `relays` a web process will answer here again: a request that is no stop waits for `close`, and is then
        passed on; a stop is carried out at once, and answered here if that takes longer than `WEB_BACK_S`.
        """
        self._listener, self._access, self._respond, self._describe = listener, access, respond, describe
        self._relays, self._closed = relays, threading.Event()
        self._waker, self._woken = socket.socketpair()
        self._callers = threading.Semaphore(MOST_CALLERS)
        self._waiting = threading.Semaphore(MOST_WAITING)
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
            access, respond, describe = page._access, staticmethod(page._respond), staticmethod(page._describe)
            content = request

            def web_is_back(self) -> bool:
                return page._relays and page._closed.wait(WEB_BACK_S)

        try:
            Handler(caller, address, None)  # type: ignore[arg-type]  # it asks its server for nothing
        except _WebIsBack:
            return False
        caller.recv(len(request))  # what is left unread would reset the connection before the answer is read
        return True

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
        found = caller.recv(BODY_BYTES, socket.MSG_PEEK)
        head, end, body = found.partition(b"\r\n\r\n")
        length = re.search(rb"\r\ncontent-length: *(\d+)", head, re.IGNORECASE)
        wanted = int(length[1]) if length else 0
        if not found or len(found) >= BODY_BYTES or (end and len(body) >= min(wanted, BODY_BYTES)):
            return found
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
    describe: Callable[[], str]
    content: bytes  #: the request, which is still in the socket

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
            self._problem(503, "no-web-process", f"{NO_WEB}. {self.describe()}")
        elif self._is_ours():
            self._send(503, "text/html; charset=utf-8", _page(self.describe()).encode())

    def do_HEAD(self) -> None:
        """Answer as `do_GET`, without the content."""
        self.do_GET()

    def do_POST(self) -> None:
        """Stop what runs, or one campaign."""
        body = self.rfile.read(min(int(self.headers.get("Content-Length") or 0), BODY_BYTES))
        found = STOP_PATH.fullmatch(self.path.partition("?")[0])
        if found is None:
            self._problem(503, "no-web-process", f"{NO_WEB}. {self.describe()}")
            return
        caller = self._caller()
        if caller is None:
            return
        given = _fields(body, self.headers.get("Content-Type", ""))
        by = str(given.get("by") or caller)
        campaign = int(found[1]) if found[1] else None
        reason = f"{given.get('reason') or 'stopped on the page'} ({by})"
        stop = StopRequest.new(by, "stop page", reason, campaign)
        last = _followed(self.respond(stop))
        if last.phase == "stands" and self.web_is_back():
            raise _WebIsBack
        self._tell(last, as_page="text/html" in self.headers.get("Accept", ""))

    def _tell(self, last: Word, *, as_page: bool) -> None:
        stands = last.phase == "stands"
        text = last.text if stands else f"NOT STOPPED: {last.text}. Use the stop switch of the bench."
        if as_page:
            self._send(200 if stands else 503, "text/html; charset=utf-8", _page(text).encode())
        elif stands:
            answer = {"stands": True, "text": text, "campaign": last.campaign}
            self._send(200, "application/json", json.dumps(answer).encode())
        else:
            self._problem(503, "not-stopped", text)

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

    def _caller(self) -> str | None:
        """Return who asks; None where the request was refused, which is then answered."""
        if self.access.keys is None:
            return (self.headers.get("Labctl-User") or "local")[:100] if self._is_ours() else None
        scheme, _, key = (self.headers.get("Authorization") or "").partition(" ")
        digest = hashlib.sha256(key.strip().encode("utf-8", "surrogatepass")).hexdigest()
        try:
            known = json.loads(self.access.keys.read_bytes())
        except (OSError, ValueError):
            known = {}
        for each, (name, role) in known.items():
            if scheme.lower() == "bearer" and hmac.compare_digest(each, digest) and role in OPERATORS:
                return str(name)
        self._problem(
            401, "not-identified", "a stop at this address needs an operator's key: Authorization: Bearer KEY"
        )
        return None

    def _problem(self, status: int, slug: str, detail: str) -> None:
        problem = {"type": f"urn:labctl:problem:{slug}", "title": slug, "status": status, "detail": detail}
        self._send(status, "application/problem+json", json.dumps(problem).encode())

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
    found: list[Word] = []
    over = threading.Event()

    def follow() -> None:
        for word in phases(stopping):
            found.append(word)
            if word.phase in LAST:
                break
        over.set()

    threading.Thread(target=follow, name="stop-follow", daemon=True).start()
    over.wait(ANSWER_S)
    return found[-1] if found else last


def _fields(body: bytes, kind: str) -> dict[str, Any]:
    if "json" not in kind:
        return {}
    try:
        given = json.loads(body or b"{}")
    except ValueError:
        return {}
    return given if isinstance(given, dict) else {}


def _page(text: str) -> str:
    return f"""<!doctype html><html lang="en"><head><meta charset="utf-8"><title>labctl: stop</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><meta http-equiv="refresh" content="5;url=/">
<style>body{{font:1.1rem/1.5 sans-serif;margin:2rem auto;max-width:40rem;padding:0 1rem}}
button{{font:inherit;font-weight:bold;padding:1rem 2rem;background:#b00020;color:#fff;border:0;border-radius:.4rem}}
</style></head><body><h1>labctl does not answer</h1><p>{html.escape(text)}</p>
<form method="post" action="/api/stop"><button>Stop the bench</button></form>
<p>This page is shown while the service is gone or starts again. It asks again every 5 s.</p></body></html>"""
