"""What is wrong with a request, in words: where, the value, its limit, and what to do."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypedDict

from pydantic_core import ErrorDetails

from instruments.laboratory import COUNTRY, LINE
from labctl.recording.info import SERIAL_PATTERN, SERIAL_RULE

#: A key or a value is shown up to here.
LONGEST_KEY, LONGEST_VALUE = 80, 40
#: Errors that one answer lists with their places.
MAX_ERRORS = 50
#: What a text that has to match a pattern is, in words.
PATTERNS: Mapping[str, str] = {
    COUNTRY: "two capital letters, the code of the country, such as DE (ISO 3166-1)",
    rf"{COUNTRY}|^$": "two capital letters, the code of the country, such as DE (ISO 3166-1)",
    LINE: "one line of at most 300 characters",
    SERIAL_PATTERN: SERIAL_RULE,
}
#: Kinds of errors by the name that pydantic gives them, and what to do in words; braces name members of its context.
WORDS: Mapping[str, str] = {
    "missing": "it is not stated; state it",
    "extra_forbidden": "this key is not known; leave it out",
    "string_type": "{value} is not a text; give a text",
    "string_too_short": "{value} is too short; give at least {min_length} characters",
    "string_too_long": "{value} is too long ({length} characters); give at most {max_length}",
    "int_parsing": "{value} is not a whole number; give one",
    "int_type": "{value} is not a whole number; give one",
    "int_from_float": "{value} is not a whole number; give one",
    "float_parsing": "{value} is not a number; give a number with a point, such as 0.1",
    "float_type": "{value} is not a number; give a number with a point, such as 0.1",
    "finite_number": "{value} is not a finite number; give one",
    "greater_than": "{value} is out of range; give more than {gt}",
    "greater_than_equal": "{value} is out of range; give {ge} or more",
    "less_than": "{value} is out of range; give less than {lt}",
    "less_than_equal": "{value} is out of range; give {le} or less",
    "bool_parsing": "{value} is neither true nor false; give one of them",
    "bool_type": "{value} is neither true nor false; give one of them",
    "literal_error": "{value} is none of the choices; give {expected}",
    "enum": "{value} is none of the choices; give {expected}",
    "date_from_datetime_parsing": "{value} is not a date; write it as 2026-01-31",
    "date_parsing": "{value} is not a date; write it as 2026-01-31",
    "date_type": "{value} is not a date; write it as 2026-01-31",
}


class RequestError(TypedDict):
    """One place of a request, and what is wrong there."""

    place: list[str]
    text: str


def in_words(errors: Sequence[ErrorDetails]) -> list[RequestError]:
    """Return each error of a validation with its place, in words."""
    return [
        RequestError(place=[str(part)[:LONGEST_KEY] for part in error["loc"]], text=_text(error)) for error in errors
    ]


def _text(error: ErrorDetails) -> str:
    value, context = error.get("input"), error.get("ctx", {})
    if error["type"] == "string_pattern_mismatch":
        rule = PATTERNS.get(context.get("pattern", ""))
        return f"{shown(value)} is not in the form that is needed; give {rule or _pattern(context)}"
    words = WORDS.get(error["type"])
    if words is None:
        return str(error["msg"]).removeprefix("Value error, ")
    length = len(value) if isinstance(value, str) else 0
    return words.format_map({**context, "value": shown(value), "length": length})


def _pattern(context: Mapping[str, Any]) -> str:
    return f"a text that matches {context.get('pattern', '')}"


def shown(value: object) -> str:
    """Return a value as an error shows it: a text in quotes, cut where it is long; of a list or table its kind."""
    kinds: dict[type, Callable[[Any], str]] = {list: lambda _: "a list", dict: lambda _: "a table"}
    if isinstance(value, str):
        cut = value if len(value) <= LONGEST_VALUE else f"{value[:LONGEST_VALUE]}..."
        return repr(cut)
    text = kinds.get(type(value), str)(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]}..."
