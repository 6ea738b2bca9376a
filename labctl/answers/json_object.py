"""JSON documents of any form, as types."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:  # these types are read where no document is validated
    from pydantic import JsonValue

#: A document whose form is known to those who wrote it; who reads it checks it against a model.
JsonObject = Mapping[str, object]

#: The same, whose values were read from JSON.
JsonDocument: TypeAlias = "Mapping[str, JsonValue]"

__all__ = ["JsonDocument", "JsonObject"]
