"""Bases of requests and responses."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class ResponseModel(BaseModel):
    """A response of the services: the same JSON on the command line and over HTTP. Keys may be added, none renamed."""

    model_config = ConfigDict(extra="allow", frozen=True, ser_json_inf_nan="null")


class Request(BaseModel):
    """A request to the services; an unknown key is an error that names it."""

    model_config = ConfigDict(extra="forbid", frozen=True)
