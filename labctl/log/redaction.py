"""What a record may hold: no key, no password, no text without an end, and no character that a terminal obeys."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from datetime import datetime
from typing import Any
from urllib.parse import unquote, urlsplit

from labctl.config import DATABASE_VARIABLE, KEY_VARIABLE

REMOVED = "***"
#: Of a value; a traceback may be longer, and keeps its end.
LONGEST, LONGEST_TRACEBACK = 1_000, 12_000
DEEPEST, MAX_ITEMS = 5, 100
#: A shorter secret would also be part of other words.
SHORTEST_SECRET = 4

_SECRET_FIELD = re.compile(r"(?i)(password|passwd|pwd|(^|[_-])(authorization|cookie|secret|token|credential|key))s?$")
_NAMED = r"(?:authorization|cookie|password|passwd|pwd|secret|token|api[_-]?key|labctl_key)"
_IN_TEXT = (
    (re.compile(r"(?i)\b(bearer)(?:\s+|%20)[\w.~+/=%-]+"), rf"\1 {REMOVED}"),
    (re.compile(r"\blabctl_[A-Za-z0-9_-]{30,}"), REMOVED),  # labctl's own keys, wherever they are
    (re.compile(r"(?i)\b([a-z][a-z0-9+.-]*://[^\s/:@?#\"']*):[^\s\"']*@"), rf"\1:{REMOVED}@"),
    (re.compile(rf"(?i)({_NAMED}[\"']?\s*[=:]\s*)(?:basic\s+)?(?:\"[^\"]*\"|'[^']*'|[^\s&,;)}}\]]+)"), rf"\1{REMOVED}"),
)


def secrets_of(environment: Mapping[str, str] = os.environ, locations: Iterable[str] = ()) -> frozenset[str]:
    """Return the secrets that this process was given: its key, and the passwords in addresses of databases."""
    secrets = {environment.get(KEY_VARIABLE, ""), environment.get("PGPASSWORD", "")}
    for location in (*locations, environment.get(DATABASE_VARIABLE, "")):
        try:
            password = urlsplit(location).password or ""
        except ValueError:  # a path that looks like an address
            continue
        secrets |= {password, unquote(password)}
    return frozenset(secret for secret in secrets if len(secret) >= SHORTEST_SECRET)


class Redaction:
    """Removes secrets from records: by the names of fields, by their form, and those that are known."""

    def __init__(self, secrets: Iterable[str] = ()) -> None:
        self._known = sorted(secrets, key=len, reverse=True)

    def text(self, text: str, longest: int = LONGEST) -> str:
        """Return a text without secrets, at most so long."""
        full_length, text = len(text), text[: 4 * longest]  # what is cut off later has been searched
        for secret in self._known:
            text = text.replace(secret, REMOVED)
        for pattern, instead in _IN_TEXT:
            text = pattern.sub(instead, text)
        return text if len(text) <= longest else f"{text[:longest]}... ({full_length} characters)"

    def traceback(self, text: str) -> str:
        """Return a traceback without secrets; of a long one the end is kept, which names the error."""
        cut = text if len(text) <= LONGEST_TRACEBACK else f"...\n{text[-LONGEST_TRACEBACK:]}"
        return self.text(cut, len(cut))

    def fields(self, fields: Mapping[str, Any], depth: int = 0) -> dict[str, Any]:
        """Return the fields of a record without secrets."""
        return {str(name): self._field(str(name), value, depth) for name, value in list(fields.items())[:MAX_ITEMS]}

    def _field(self, name: str, value: Any, depth: int) -> Any:
        if name == "exception" and isinstance(value, str):
            return self.traceback(value)
        return REMOVED if _SECRET_FIELD.search(name) else self._value(value, depth)

    def _value(self, value: Any, depth: int) -> Any:
        if value is None or isinstance(value, bool | int | float):
            return value
        if isinstance(value, datetime):
            return value.isoformat()
        if isinstance(value, Mapping) and depth < DEEPEST:
            return self.fields(value, depth + 1)
        if isinstance(value, list | tuple | set | frozenset) and depth < DEEPEST:
            return [self._value(each, depth + 1) for each in list(value)[:MAX_ITEMS]]
        return self.text(str(value))
