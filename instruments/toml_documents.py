"""TOML of unknown origin: bounded in size and depth before the parser sees it.

The parser of the standard library recurses into every bracket and takes the square of the time for a key of many parts,
so both are counted first, in one pass over the text.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from reprlib import Repr

#: The largest file or text that is read.
MAX_BYTES = 1 << 20
#: The deepest nesting of brackets, and the most parts of a dotted key; no file of labctl needs more than 4.
DEEPEST = 32

#: A string or a comment hides what is in it; one that is not closed reaches to the end, where the parser finds it.
_TOKENS = re.compile(
    r'"""(?:\\.|[^\\])*?(?:"""|\Z)'
    r"|'''.*?(?:'''|\Z)"
    r'|"(?:\\.|[^"\\\n])*"?'
    r"|'[^'\n]*'?"
    r"|\#[^\n]*|[\[\]{}.=,\n]",
    re.DOTALL,
)
_SHOWN = Repr()
_SHOWN.maxstring = _SHOWN.maxother = 80
_SHOWN.maxlevel = 1


def shown(value: object) -> str:
    """Return a value as a message shows it: whole where it is short, else its beginning."""
    return _SHOWN.repr(value)


def listed(complaints: Iterable[str], most: int = 5) -> str:
    """Return complaints as one line: the first few, and how many more there are."""
    problems = list(complaints)
    more = len(problems) - most
    return "; ".join(problems[:most]) + (f"; and {more} more" if more > 0 else "")


def read_toml_text(path: Path) -> str:
    """Return the text of a TOML file. Raises OSError, UnicodeDecodeError, and TOMLDecodeError for one over 1 MiB."""
    with path.open("rb") as file:
        content = file.read(MAX_BYTES + 1)
    if len(content) > MAX_BYTES:
        raise tomllib.TOMLDecodeError(f"larger than {MAX_BYTES} bytes, the limit of such a file")
    return content.decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")


def parse_toml(text: str) -> dict[str, object]:
    """Return what a TOML text says. Raises TOMLDecodeError, also where it is too long or nested too deeply."""
    if len(text) > MAX_BYTES:
        raise tomllib.TOMLDecodeError(
            f"{len(text)} characters long; the limit of such a file is {MAX_BYTES} characters"
        )
    _refuse_deep(text)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except (ValueError, OverflowError, RecursionError) as error:  # a number of thousands of digits, a day 0
        raise tomllib.TOMLDecodeError(str(error).partition(";")[0]) from None


def read_toml(path: Path) -> dict[str, object]:
    """Return what a TOML file says. Raises OSError, UnicodeDecodeError, TOMLDecodeError."""
    return parse_toml(read_toml_text(path))


def _refuse_deep(text: str) -> None:
    brackets = parts = 0
    for token in _TOKENS.finditer(text):
        mark = token.group()
        if mark == ".":
            parts += 1
        elif mark in "[]{}=,\n":
            parts = 0
            brackets += (mark in "[{") - (mark in "]}")
        if brackets > DEEPEST or parts >= DEEPEST:
            line = text.count("\n", 0, token.start()) + 1
            what = "brackets are nested" if brackets > DEEPEST else "a dotted key is"
            raise tomllib.TOMLDecodeError(
                f"line {line}: {what} more than {DEEPEST} levels deep, the limit of such a file"
            )
