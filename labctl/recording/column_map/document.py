"""A column map as a TOML document, and back; every wrong entry in one clear line."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import tomli_w
from pydantic import JsonValue, ValidationError

from instruments.toml_documents import parse_toml, read_toml_text, shown
from labctl.errors import BadInput
from labctl.recording.column_map.model import ColumnMap

LONGEST_PLACE = 80


def read_map(path: Path) -> ColumnMap:
    """Return the map of a file; raises BadInput naming the key and what it may be."""
    try:
        text = read_toml_text(path)
    except OSError as error:
        raise BadInput(f"--map {path}: {error.strerror or error}; name an existing file") from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise BadInput(f"--map {path}: not TOML: {error}; correct the map") from error
    return parse_map(text, f"--map {path}")


def parse_map(text: str, name: str = "map") -> ColumnMap:
    """Return the map that a TOML text says; raises BadInput."""
    try:
        document = parse_toml(text)
    except tomllib.TOMLDecodeError as error:
        raise BadInput(f"{name}: not TOML: {error}; correct the map") from error
    return checked_map(document, name)


def checked_map(document: object, name: str = "map") -> ColumnMap:
    """Return a map from its keys and values; raises BadInput with every wrong entry."""
    try:
        return ColumnMap.model_validate(document)
    except ValidationError as error:
        # a misspelt key is both unknown and missing: the unknown one is what a person looks for
        each = sorted(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
        raise BadInput(f"{name}: {'; '.join(_line(problem) for problem in each[:5])}; correct the map") from error


def _line(error: Any) -> str:
    place = ".".join(str(part) for part in error["loc"])[:LONGEST_PLACE]
    text = error["msg"].removeprefix("Value error, ")
    value_text = "" if error["type"] in {"missing", "value_error"} else f" (is {shown(error['input'])})"
    return f"{place}: {text}{value_text}" if place else f"{text}{value_text}"


def map_document(column_map: ColumnMap) -> dict[str, JsonValue]:
    """Return the keys and values of a map, without what is left at its default."""
    document = column_map.model_dump(mode="json", by_alias=True, exclude_none=True, exclude_defaults=True)
    return {"format": column_map.format, **document}


def map_text(column_map: ColumnMap) -> str:
    """Return a map as TOML, without what is left at its default."""
    return tomli_w.dumps(map_document(column_map))
