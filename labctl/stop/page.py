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
from pathlib import Path
from typing import Any

from labctl.stop.latch import StopRequest
from labctl.stop.wire import LAST, Stopping, Word, phases

#: A request that is not read, or an answer that is not taken, within this is dropped, s.
PATIENCE_S = 5.0
#: A stop is answered after this at the latest, with how far it is, s.
ANSWER_S = 4.0
MOST_CALLERS = 32
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
    ) -> None:
        """Answer with what `describe` says of the bench; a stop begins with `respond`."""
        self._listener, self._access, self._respond, self._describe = listener, access, respond, describe
        self._waker, self._woken = socket.socketpair()
        self._callers = threading.Semaphore(MOST_CALLERS)
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
        page = self

        class Handler(_Handler):
            access, respond, describe = page._access, staticmethod(page._respond), staticmethod(page._describe)

        try:
            caller.settimeout(PATIENCE_S)
            with caller, contextlib.suppress(OSError, ValueError):
                Handler(caller, address, None)  # type: ignore[arg-type]  # it asks its server for nothing
        finally:
            self._callers.release()


class _Handler(BaseHTTPRequestHandler):
    """One request."""

    protocol_version = "HTTP/1.0"  # a connection carries one request: the next one may be the web process's
    access: PageAccess
    respond: Callable[[StopRequest], Stopping]
    describe: Callable[[], str]

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

    def log_message(self, *_: Any) -> None:
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
