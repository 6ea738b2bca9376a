"""Serves the pages: one HTML document for every address, and the files it loads. All data comes from the HTTP API."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from inspect import isawaitable
from pathlib import Path
from typing import Any

import plotly
from fastapi import FastAPI, Request, Response
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from labctl.web.assets import CODINGS, IMMUTABLE, REVALIDATED, Asset, Assets, accepted_codings
from labctl.web.bundles import PLOTLY_BUILD, PREFIX, links

FOLDER = Path(__file__).parent / "static"
PLOTLY = Path(str(plotly.__file__)).parent / "package_data" / "plotly.min.js"
#: Plotly's own build of the same version without maps, finance and three dimensions: a third of the size.
PLOTLY_CARTESIAN = Path(__file__).parent / "vendor" / "plotly-cartesian.min.js"
#: Tells a browser to compile all functions of a script in another thread, while it comes; without it the page stands
#: still longer when they are first called (Chromium's explicit compile hints; a comment to other browsers).
COMPILED_BEFORE = b"//# allFunctionsCalledOnLoad\n"
STATIC = "/static/"
#: Before it stands what a page needs beside the entry point: module scripts run in the order of the document.
ENTRY_SCRIPT = '  <script type="module"'
#: Address prefixes of the pages; the router in the browser handles the rest of an address.
PAGES = (
    "/start", "/bench", "/live", "/campaigns", "/units", "/explore", "/recordings", "/noise", "/effects",
    "/certificates", "/fleet", "/standards",
)  # fmt: skip
#: Scripts and styles of labctl only, and no embedding in a frame. Plotly writes inline styles, and compiles shaders for
#: surfaces, which needs 'unsafe-eval'.
POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; connect-src 'self' data: blob:; frame-ancestors 'none'; base-uri 'none'; "
    "form-action 'self'"
)
HEADERS = {
    b"content-security-policy": POLICY.encode(),
    b"x-content-type-options": b"nosniff",
    b"referrer-policy": b"no-referrer",
}


def install(app: FastAPI) -> None:
    """Add the routes of the pages, the static files and the security headers to an application."""
    assets = _assets()
    document = (FOLDER / "index.html").read_text(encoding="utf-8")

    def index(request: Request) -> Response:
        """Return the document of every page, which names the files of this release."""
        release = assets.release()
        whole = document.replace(ENTRY_SCRIPT, f"{links(assets.bundles, request.url.path)}{ENTRY_SCRIPT}")
        body = whole.replace(STATIC, f"{STATIC}{release}/").encode()
        return _response(request, Asset.of(body, "text/html"), REVALIDATED)

    def static(request: Request, address: str) -> Response:
        """Return a file, compressed as the browser takes it."""
        name, is_released = assets.split(address)
        asset = assets.get(name, accepted_codings(request.headers.get("accept-encoding", "")))
        if asset is None:
            raise HTTPException(404, f"no file {name!r} of the pages; reload the page")
        return _response(request, asset, IMMUTABLE if is_released else REVALIDATED)

    for path in ("/", *PAGES, *(f"{page}/{{rest:path}}" for page in PAGES)):
        app.add_api_route(path, index, methods=["GET", "HEAD"], include_in_schema=False)
    app.add_api_route(f"{STATIC}{{address:path}}", static, methods=["GET", "HEAD"], include_in_schema=False)
    of_programs = app.exception_handlers[HTTPException]

    async def unknown(request: Request, error: Exception) -> Response:
        """Return the document of the pages to a person who asks for what is no page; it says so."""
        if not _is_of_a_browser(request):
            return await _answer_of(of_programs, request, error)
        answer = index(request)
        answer.status_code = 404 if answer.status_code == 200 else answer.status_code
        return answer

    app.add_exception_handler(404, unknown)
    app.add_middleware(_SecurityHeaders)


@cache
def _assets() -> Assets:
    """Return the files, compressed once per process."""
    others = {"plotly.js": PLOTLY, PLOTLY_BUILD: PLOTLY_CARTESIAN}
    return Assets(FOLDER, others, {PLOTLY_BUILD: COMPILED_BEFORE})


def prepare() -> None:
    """Bundle and compress what every page loads first, before a browser asks for it: 0.1 s of processor time."""
    for name in (f"{PREFIX}main.css", f"{PREFIX}main.js", PLOTLY_BUILD):
        _assets().get(name, CODINGS)


def _is_of_a_browser(request: Request) -> bool:
    """Return whether a person's browser asks for a page, and not a program, a file or the API."""
    reads = request.method in {"GET", "HEAD"} and "text/html" in request.headers.get("accept", "")
    return reads and not request.url.path.startswith(("/api", STATIC))


async def _answer_of(handler: Callable[..., Any], request: Request, error: Exception) -> Response:
    answer = handler(request, error)
    response: Response = await answer if isawaitable(answer) else answer
    return response


def _response(request: Request, asset: Asset, cache_control: str) -> Response:
    """Return an asset with its validator, or 304 without a body where the browser has it (RFC 9110, 13.1.2)."""
    headers = {"cache-control": cache_control, "etag": asset.etag, "vary": "Accept-Encoding"}
    if asset.coding:
        headers["content-encoding"] = asset.coding
    known = {tag.strip().removeprefix("W/") for tag in request.headers.get("if-none-match", "").split(",")}
    if asset.etag in known:
        return Response(status_code=304, headers=headers)
    return Response(asset.body, media_type=asset.media_type, headers=headers)


def is_page(path: str) -> bool:
    """Return whether a path is a page or a static file; both hold no data of the laboratory and need no API key."""
    return path == "/" or path.startswith(STATIC) or any(path == page or path.startswith(f"{page}/") for page in PAGES)


def _is_document(message: Message) -> bool:
    return Headers(raw=message["headers"]).get("content-type", "").startswith("text/html")


class _SecurityHeaders:
    """ASGI middleware that adds `HEADERS` to every page and static file; responses of the API pass unchanged."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["path"].startswith("/api"):
            await self._app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start" and (is_page(scope["path"]) or _is_document(message)):
                message["headers"] = [*message["headers"], *HEADERS.items()]
            await send(message)

        await self._app(scope, receive, send_with_headers)
