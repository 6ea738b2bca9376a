"""The catalogue of physical effects."""

from __future__ import annotations

import hashlib
from typing import Annotated

from fastapi import APIRouter, Header, Response

from labctl.answers.calibrations import CatalogueResponse
from labctl.services.effects import catalogue

router = APIRouter(prefix="/api", tags=["catalogue"])


@router.get("/effects", summary="The catalogue of physical effects", response_model=CatalogueResponse)
def effects(if_none_match: Annotated[str | None, Header()] = None) -> Response:
    """Every effect that a model can contain: its standard term, description, origin, channels, coefficients and
    ranges. 304 when the caller has it already."""
    content = catalogue().model_dump_json().encode()
    headers = {"ETag": f'W/"{hashlib.sha256(content).hexdigest()}"', "Cache-Control": "no-cache"}
    if if_none_match and headers["ETag"] in if_none_match:
        return Response(status_code=304, headers=headers)
    return Response(content, media_type="application/json", headers=headers)
