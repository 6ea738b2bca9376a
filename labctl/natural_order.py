"""The order of serial numbers: runs of digits count as whole numbers, so that A-2 comes before A-10."""

from __future__ import annotations

import re

#: Digits of the length that stands before a number; a serial number has 200 characters at most (`units.serial`).
_LENGTH_DIGITS = 3
_NUMBER = re.compile("[0-9]+")
#: Between the key and the zeros in front of its numbers; below every character of a serial number.
_ZEROS = "\x01"


def natural_key(text: str) -> str:
    """Return a text whose order by its bytes (UTF-8) is the natural order; another text has another key.

    Each number is written without zeros in front and after the number of its digits, so that a longer one comes later:
    A-2 is A-0012, and A-10 is A-00210. Where numbers are equal, that with fewer zeros in front comes first: A-2, A-02.
    What is not a number is compared character by character, as the database compares texts; so are the numbers with
    it, at the place of the digits. Sorting by this key needs no collation that a database would have to offer.
    """
    zeros: list[str] = []

    def with_length(match: re.Match[str]) -> str:
        digits = match.group().lstrip("0") or "0"
        zeros.append(f"{len(match.group()) - len(digits):0{_LENGTH_DIGITS}d}")
        return f"{len(digits):0{_LENGTH_DIGITS}d}{digits}"

    key = _NUMBER.sub(with_length, text)
    return f"{key}{_ZEROS}{''.join(zeros)}" if any(int(each) for each in zeros) else key
