"""Swagger UI with files from this machine, so that it works without a network."""

from __future__ import annotations

from importlib import resources

from fastapi import APIRouter
from fastapi.responses import HTMLResponse, Response

from labctl.errors import NotFound

router = APIRouter(include_in_schema=False)

#: The files that are served, as the package that carries them calls them.
FILES = {"swagger-ui-bundle.js": "text/javascript", "swagger-ui.css": "text/css", "favicon.png": "image/png"}
PAGE = """<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>labctl: the HTTP interface</title>
<link rel="icon" href="api-docs/favicon.png"><link rel="stylesheet" href="api-docs/swagger-ui.css"></head>
<body><div id="swagger-ui"></div>
<script src="api-docs/swagger-ui-bundle.js"></script><script src="api-docs/start.js"></script>
<noscript>This page needs scripts;
<a href="openapi.json">openapi.json</a> describes the interface for programs.</noscript>
</body>
</html>
"""
#: Without a validator: it would send the description to a server elsewhere.
START = """SwaggerUIBundle({
  url: "openapi.json", dom_id: "#swagger-ui", deepLinking: true, validatorUrl: null,
  presets: [SwaggerUIBundle.presets.apis],
});
"""


@router.get("/api-docs")
def page() -> HTMLResponse:
    """Swagger UI, which reads `openapi.json`."""
    return HTMLResponse(PAGE)


@router.get("/api-docs/{name}")
def file(name: str) -> Response:
    """A script, style sheet or icon of Swagger UI. Raises NotFound."""
    if name == "start.js":
        return Response(START, media_type="text/javascript")
    if name not in FILES:
        raise NotFound(f"there is no file {name!r}; open api-docs")
    path = resources.files("fastapi_offline") / "static" / name
    return Response(path.read_bytes(), media_type=FILES[name], headers={"Cache-Control": "max-age=86400"})
