"""How a request reaches the house it belongs to."""

from __future__ import annotations

from typing import Annotated, cast

from fastapi import Depends, Request

from labctl.services.app import House


def house_of(request: Request) -> House:
    """Return the house that this application serves."""
    return cast(House, request.app.state.house)


HouseOf = Annotated[House, Depends(house_of)]
