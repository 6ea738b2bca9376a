"""The names that outsiders rely on, read from the program: commands, options, HTTP paths and JSON keys."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import typer
from fastapi import FastAPI

from labctl.cli.app import app


def command_names() -> dict[str, set[str]]:
    """Return the options of every command, by its words: {"campaign plan": {"--bench", "--clip"}}."""
    return dict(_commands(typer.main.get_command(app), []))


def _commands(command: Any, words: list[str]) -> Iterator[tuple[str, set[str]]]:
    if not hasattr(command, "list_commands"):
        options = [each for each in command.params if each.param_type_name == "option"]
        yield " ".join(words), {name for option in options for name in (*option.opts, *option.secondary_opts)}
        return
    for name in command.list_commands(None):  # those that a group makes from declarations among them
        yield from _commands(command.get_command(None, name), [*words, name])


def route_names(application: FastAPI) -> dict[str, dict[str, set[str]]]:
    """Return parameters, request keys and response keys of every operation, by method and path."""
    document = application.openapi()
    schemas = document["components"]["schemas"]
    return {
        f"{method.upper()} {path}": {
            "parameters": {each["name"] for each in operation.get("parameters", [])},
            "request": set(_content_keys(operation.get("requestBody", {}), schemas)),
            "response": {
                key
                for status, answer in operation["responses"].items()
                if status.startswith("2")
                for key in _content_keys(answer, schemas)
            },
        }
        for path, operations in document["paths"].items()
        for method, operation in operations.items()
    }


def _content_keys(body: dict[str, Any], schemas: dict[str, Any]) -> Iterator[str]:
    for kind in body.get("content", {}).values():
        yield from _schema_keys(kind.get("schema", {}), schemas, "", ())


def _schema_keys(schema: dict[str, Any], schemas: dict[str, Any], above: str, seen: tuple[str, ...]) -> Iterator[str]:
    """Yield the dotted path of every key that a schema declares; `[]` is any item of a list, `*` any value of a map."""
    if "$ref" in schema:
        name = schema["$ref"].rsplit("/", 1)[-1]
        if name not in seen:
            yield from _schema_keys(schemas[name], schemas, above, (*seen, name))
        return
    for part in [*schema.get("anyOf", []), *schema.get("allOf", []), *schema.get("oneOf", [])]:
        yield from _schema_keys(part, schemas, above, seen)
    if "items" in schema:
        yield from _schema_keys(schema["items"], schemas, f"{above}[]", seen)
    if isinstance(schema.get("additionalProperties"), dict):
        yield from _schema_keys(schema["additionalProperties"], schemas, f"{above}.*".lstrip("."), seen)
    for key, value in schema.get("properties", {}).items():
        path = f"{above}.{key}".lstrip(".")
        yield path
        yield from _schema_keys(value, schemas, path, seen)


def has_key(document: Any, path: str) -> bool:
    """Return whether a JSON document has a key at a dotted path; an empty list or map has none."""
    if not path:
        return True
    word, _, rest = path.partition(".")
    if word == "[]":
        return bool(document) and all(has_key(item, rest) for item in document)
    if word == "*":
        return bool(document) and all(has_key(value, rest) for value in document.values())
    name = word.removesuffix("[]")
    return name in document and has_key(document[name], f"[].{rest}" if word.endswith("[]") else rest)
