"""JSON documents of any form, as types."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, TypeAlias

#: A document whose form is known to those who wrote it; who reads it checks it against a model.
JsonObject = Mapping[str, object]

if TYPE_CHECKING:  # most of those who import this validate no document
    from pydantic import JsonValue

    #: The same, whose values were read from JSON.
    JsonDocument: TypeAlias = Mapping[str, JsonValue]
else:
    JsonDocument = JsonObject

__all__ = ["JsonDocument", "JsonObject"]
