"""Bases of requests and responses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar

from pydantic import BaseModel, ConfigDict, GetJsonSchemaHandler, ValidationInfo, field_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError

from labctl.texts import cleaned, control_character

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


class SeveralLines:
    """Marks a text of a request that may have several lines."""


#: A text of a request that may have several lines.
LongText = Annotated[str, SeveralLines()]


class Request(BaseModel):
    """A request to the services; an unknown key is an error that names it, and so is a control character in a text.

    Every text of a request is one line, unless it is a `LongText`.
    """

    # built at once: FastAPI would build the form of a body late too, and then warn of the alias that it gives it
    model_config = ConfigDict(extra="forbid", frozen=True)
    #: Whether control characters of texts become spaces: of an act that must not fail for the words that describe it.
    cleans_texts: ClassVar[bool] = False

    @field_validator("*")
    @classmethod
    def _without_control_characters(cls, value: object, info: ValidationInfo) -> object:
        name = info.field_name or ""
        if cls.cleans_texts and isinstance(value, str):
            return cleaned(value)
        lines = any(isinstance(each, SeveralLines) for each in cls.model_fields[name].metadata)
        for text in _texts(value):
            if character := control_character(text, lines=lines):
                what = "a line break, tab or other control character" if not lines else "a control character"
                words = "it has {what} ({found}); write it without"
                raise PydanticCustomError("control_character", words, {"what": what, "found": character})
        return value


def _texts(value: object) -> Iterator[str]:
    """Yield a text, those of a list, and those of a model that is no request: one of these examines its own."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, (list, tuple)):
        for each in value:
            yield from _texts(each)
    elif isinstance(value, BaseModel) and not isinstance(value, Request):
        for _, each in value:
            yield from _texts(each)
