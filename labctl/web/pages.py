"""Serves the pages: one HTML document for every address, and the files it loads. All data comes from the HTTP API."""

from __future__ import annotations

from pathlib import Path

import plotly
from fastapi import FastAPI
from fastapi.responses import FileResponse
from fastapi.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send

FOLDER = Path(__file__).parent / "static"
PLOTLY = Path(str(plotly.__file__)).parent / "package_data" / "plotly.min.js"
STATIC = "/static/"
#: Address prefixes of the pages; the router in the browser handles the rest of an address.
PAGES = (
    "/start", "/bench", "/live", "/campaigns", "/units", "/explore", "/recordings", "/noise", "/effects",
    "/certificates",
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
    b"cache-control": b"no-cache",  # revalidated on each request, answered 304 while unchanged
}


def install(app: FastAPI) -> None:
    """Add the routes of the pages, the static files and the security headers to an application."""

    def index() -> FileResponse:
        return FileResponse(FOLDER / "index.html", media_type="text/html")

    def plotly_script() -> FileResponse:
        return FileResponse(PLOTLY, media_type="text/javascript")

    app.add_api_route(f"{STATIC}plotly.js", plotly_script, include_in_schema=False)
    app.mount(STATIC.rstrip("/"), StaticFiles(directory=FOLDER))
    for path in ("/", *PAGES, *(f"{page}/{{rest:path}}" for page in PAGES)):
        app.add_api_route(path, index, include_in_schema=False)
    app.add_middleware(_SecurityHeaders)


def is_page(path: str) -> bool:
    """Return whether a path is a page or a static file; both hold no data of the laboratory and need no API key."""
    return path == "/" or path.startswith(STATIC) or any(path == page or path.startswith(f"{page}/") for page in PAGES)


class _SecurityHeaders:
    """ASGI middleware that adds `HEADERS` to every page and static file; responses of the API pass unchanged."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or not is_page(scope["path"]):
            await self._app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message["headers"], *HEADERS.items()]
            await send(message)

        await self._app(scope, receive, send_with_headers)
