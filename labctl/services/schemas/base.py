"""Bases of requests and responses."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

#: Description of `by_key` and its like in responses.
BY_KEY = "Name of the API key that acted; null: none did, the person's name is as typed."


class ResponseModel(BaseModel):
    """A response of the services: the same JSON on the command line and over HTTP. Keys may be added, none renamed."""

    # undeclared keys: of a service that is newer, or of a version that an older version of labctl kept
    model_config = ConfigDict(defer_build=True, extra="ignore", frozen=True, ser_json_inf_nan="null")

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Say that every key is there: a default only fills in what a maker leaves out.

        Not by `json_schema_serialization_defaults_required`, which would promise keys of typed dictionaries that may
        be absent.
        """
        schema = handler(core_schema)
        declared = handler.resolve_ref_schema(schema)
        if handler.mode == "serialization" and "properties" in declared:
            declared["required"] = list(declared["properties"])
        return schema


class Request(BaseModel):
    """A request to the services; an unknown key is an error that names it."""

    model_config = ConfigDict(extra="forbid", frozen=True)
