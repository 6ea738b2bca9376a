"""Serves the pages: one shell for every address, and the files it loads. No page knows what the API does not say."""

from __future__ import annotations

from pathlib import Path

import plotly
from fastapi import FastAPI
from fastapi.responses import FileResponse
from fastapi.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send

FOLDER = Path(__file__).parent / "static"
PLOTLY = Path(plotly.__file__).parent / "package_data" / "plotly.min.js"
STATIC = "/static/"
#: Every address that a page has; what follows is the page's own business.
PAGES = ("/start", "/bench", "/campaigns", "/units", "/explore", "/recordings", "/effects")
#: Only our own files, and no frame around them. Plotly writes styles, and compiles the shaders of surfaces.
POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; connect-src 'self' data: blob:; frame-ancestors 'none'; base-uri 'none'; "
    "form-action 'self'"
)
HEADERS = {
    b"content-security-policy": POLICY.encode(),
    b"x-content-type-options": b"nosniff",
    b"referrer-policy": b"no-referrer",
    b"cache-control": b"no-cache",  # asked for again each time, answered 304 while nothing changed
}


def install(app: FastAPI) -> None:
    """Add the pages to an application."""

    def shell() -> FileResponse:
        return FileResponse(FOLDER / "index.html", media_type="text/html")

    def script() -> FileResponse:
        return FileResponse(PLOTLY, media_type="text/javascript")

    app.add_api_route(f"{STATIC}plotly.js", script, include_in_schema=False)
    app.mount(STATIC.rstrip("/"), StaticFiles(directory=FOLDER))
    for path in ("/", *PAGES, *(f"{page}/{{rest:path}}" for page in PAGES)):
        app.add_api_route(path, shell, include_in_schema=False)
    app.add_middleware(_Dressed)


def is_page(path: str) -> bool:
    """Whether an address is a page or a file of one, which hold nothing of the house and are shown without a key."""
    return path == "/" or path.startswith(STATIC) or any(path == page or path.startswith(f"{page}/") for page in PAGES)


class _Dressed:
    """Gives pages and their files the headers that keep strangers' scripts out."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or not is_page(scope["path"]):
            await self._app(scope, receive, send)
            return

        async def dressed(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message["headers"], *HEADERS.items()]
            await send(message)

        await self._app(scope, receive, dressed)
