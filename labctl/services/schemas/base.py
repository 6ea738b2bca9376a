"""Bases of requests and responses."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class ResponseModel(BaseModel):
    """A response of the services: the same JSON on the command line and over HTTP. Keys may be added, none renamed."""

    model_config = ConfigDict(
        extra="ignore",  # of a service that is newer, or a version that an older labctl kept
        frozen=True,
        ser_json_inf_nan="null",
        json_schema_serialization_defaults_required=True,  # every key is always there
    )


class Request(BaseModel):
    """A request to the services; an unknown key is an error that names it."""

    model_config = ConfigDict(extra="forbid", frozen=True)
