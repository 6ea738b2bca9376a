"""How a request reaches the house it belongs to."""

from __future__ import annotations

from typing import Annotated, cast

from fastapi import Depends, Request

from labctl.services.app import LabService


def get_service(request: Request) -> LabService:
    """Return the house that this application serves."""
    return cast(LabService, request.app.state.service)


ServiceDep = Annotated[LabService, Depends(get_service)]
