"""Free texts that people type, in which what a terminal, a list or a file would obey is found; and counts in words."""

from __future__ import annotations

import unicodedata

#: Characters that turn the direction of a text, so that it reads as another one.
_DIRECTIONS = frozenset(map(chr, (*range(0x202A, 0x202F), *range(0x2066, 0x206A))))
#: Control characters, separators of lines and paragraphs, and halves of a character (Unicode categories).
_CATEGORIES = frozenset({"Cc", "Zl", "Zp", "Cs"})
#: First letters of the Unicode categories of separators, controls and formats.
_UNSEEN = frozenset("ZC")
#: What a text of several lines may have of these.
_LINES = frozenset("\n\r\t")
#: Of a service without a bench, with what follows from it after a semicolon or a comma.
NO_BENCH = "this service drives no bench"


def counted(number: int, noun: str) -> str:
    """Return a number of things in words, such as "1 calibration" and "2 calibrations"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def control_character(text: str, *, lines: bool = False) -> str:
    """Return the first control character of a text as words, such as "U+001B at character 5"; empty: it has none.

    With `lines` the text may have several lines, and tabs.
    """
    for place, each in enumerate(text, 1):
        if _is_control(each) and not (lines and each in _LINES):
            return f"U+{ord(each):04X} at character {place}"
    return ""


def cleaned(text: str) -> str:
    """Return a text with a space in place of each control character."""
    return "".join(" " if _is_control(each) else each for each in text)


def is_blank(text: str) -> bool:
    """Return whether nothing of a text can be seen: no letter, mark, digit, punctuation or symbol."""
    return all(unicodedata.category(each)[0] in _UNSEEN for each in text)


def _is_control(character: str) -> bool:
    return character in _DIRECTIONS or unicodedata.category(character) in _CATEGORIES
