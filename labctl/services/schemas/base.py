"""Bases of requests and responses."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class ResponseModel(BaseModel):
    """A response of the services: the same JSON on the command line and over HTTP. Keys may be added, none renamed."""

    # every answer has every key, so its schema requires those with a default too
    model_config = ConfigDict(
        extra="allow", frozen=True, ser_json_inf_nan="null", json_schema_serialization_defaults_required=True
    )


class Request(BaseModel):
    """A request to the services; an unknown key is an error that names it."""

    model_config = ConfigDict(extra="forbid", frozen=True)
