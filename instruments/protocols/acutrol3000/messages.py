"""Messages to an ACUTROL 3000, taken apart: mnemonics in long and short form, and the rules of the command tree.

A message begins at the root. A command that begins with a colon begins there again; another one stays at the subsystem
of the command before it (TM-8004 page 3). Mnemonics may be shortened, in any case of letters.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

#: Main command -> its subsystem commands; where a short form fits several, the first one is meant.
TREE = {
    "configure": ("oscillator",),
    "demand": ("rate", "position", "deltaposition", "oscillator"),
    "read": ("rate", "position", "acceleration"),
    "mode": ("rate", "position", "off", "synthesis"),
    "interlock": ("close", "open", "reset"),
    "limit": ("rate", "acceleration", "absolute"),
    "status": ("csr", "msg", "stb", "esr"),
}
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(\s*[eE]\s*[+-]?\s*\d+)?")


class ParseError(Exception):
    """A message that is no command of the tree."""


@dataclass(frozen=True)
class Command:
    """One command: its whole path, in lower case, with a question mark for a query, and its arguments."""

    path: str
    arguments: tuple[str, ...]

    def value(self, at: int) -> float:
        """Return an argument as a number; raises ParseError."""
        if len(self.arguments) <= at or not NUMBER.fullmatch(self.arguments[at]):
            raise ParseError(self.path)
        return float(re.sub(r"\s", "", self.arguments[at]))


def commands_of(message: str) -> Iterator[Command]:
    """Yield the commands of a message; raises ParseError."""
    main = ""
    for part in message.split(";"):
        text = part.strip()
        if not text:
            continue
        header, _, rest = text.partition(" ")
        query = "?" if header.endswith("?") else ""
        words = header.rstrip("?").lower().split(":")
        arguments = tuple(each.strip() for each in rest.split(",")) if rest.strip() else ()
        if header.startswith("*"):
            yield Command(header.lower(), arguments)
            continue
        if header.startswith(":") or not main:
            words = words[1:] if header.startswith(":") else words
            main, words = _full(words[0], tuple(TREE)), words[1:]
        if len(words) > 1:
            raise ParseError(text)
        path = f"{main}:{_full(words[0], TREE[main])}" if words else main
        yield Command(path + query, arguments)


def _full(word: str, names: tuple[str, ...]) -> str:
    """Return the mnemonic that a word is the beginning of; raises ParseError."""
    for name in names:
        if word and name.startswith(word):
            return name
    raise ParseError(word)
