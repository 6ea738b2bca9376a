"""The bytes of a text file as UTF-8, piece by piece, with separators that the reader of tables knows."""

from __future__ import annotations

import codecs
import re
from pathlib import Path

from labctl.errors import BadRecording
from labctl.recording.unread import share_text

BLOCK_BYTES = 1 << 20
_UTF16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
#: Bytes below this that a text has: tab, line feed, vertical tab, form feed, carriage return.
_ALLOWED = frozenset(b"\t\n\x0b\x0c\r\x1a")
_SPACES = re.compile(r"[ \t]+")


def encoding_of(path: Path, head: bytes) -> str:
    """Return the encoding of a text by its first bytes: utf-8, utf-16 or cp1252; raises BadRecording for no text."""
    if head.startswith(_UTF16):
        return "utf-16"
    odd, even = head[1::2], head[::2]
    if len(head) > 3 and max(odd.count(0), even.count(0)) > 0.3 * len(head) / 2:
        which = "little" if odd.count(0) > even.count(0) else "big"
        if min(odd.count(0), even.count(0)) == 0:
            raise BadRecording(
                f"{path}: UTF-16 ({which}-endian) without a byte-order mark; save it as UTF-8, or write "
                'encoding = "utf-16" in [file] of a map after adding the mark'
            )
    for position, byte in enumerate(head):
        if byte < 32 and byte not in _ALLOWED:
            raise BadRecording(
                f"{path}: the file is binary (byte {position + 1} is {byte:#04x}), and no installed importer "
                "reads it; export it as CSV, or install the package of an importer for it"
            )
    try:
        codecs.getincrementaldecoder("utf-8-sig")().decode(head)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"


class TextStream:
    """A file object of UTF-8 bytes, as pyarrow reads one; runs of blanks become tabs where `blanks` is given.

    Raises BadRecording for a NUL byte, and for what is no text in the encoding.
    """

    def __init__(self, path: Path, encoding: str, *, blanks: bool) -> None:
        self.path, self.encoding, self.blanks = path, encoding, blanks
        self.closed = False
        self._file = path.open("rb")
        name = "utf-8-sig" if encoding == "utf-8" else encoding
        self._decoder = codecs.getincrementaldecoder(name)(errors="strict")
        self._left = ""
        self._ready = b""
        self._taken = 0

    def read(self, size: int = -1) -> bytes:
        """Return up to `size` bytes, empty at the end."""
        while not self._ready or 0 <= len(self._ready) < size:
            piece = self._next()
            if piece is None:
                break
            self._ready += piece
        size = len(self._ready) if size < 0 else size
        chunk, self._ready = self._ready[:size], self._ready[size:]
        return chunk

    def readable(self) -> bool:
        """Whether it can be read."""
        return True

    def close(self) -> None:
        """Close the file."""
        self.closed = True
        self._file.close()

    def _next(self) -> bytes | None:
        block = self._file.read(BLOCK_BYTES)
        try:
            text = self._decoder.decode(block, final=not block)
        except UnicodeDecodeError as error:
            raise BadRecording(
                f"{self.path}: not {self.encoding} text near byte {self._taken + error.start + 1}: {error.reason}; "
                "save it as UTF-8"
            ) from error
        if "\0" in text:
            sound = self._taken + max(block.find(b"\0"), 0)
            share = share_text(1 - sound / self.path.stat().st_size)
            raise BadRecording(
                f"{self.path}: the file has a NUL byte at byte {sound + 1}, so it is binary, damaged, or a log whose "
                "end was lost when the power was switched off; remove everything "
                f"after byte {sound} ({share} of the file), "
                "or copy it again from where it was recorded"
            )
        self._taken += len(block)
        if not self.blanks:
            return None if not block and not text else text.encode()
        if not block:
            last, self._left = self._left + text, ""
            return _tabbed(last).encode() if last else None
        whole, newline, self._left = (self._left + text).rpartition("\n")
        return (_tabbed(whole) + newline).encode()


def _tabbed(text: str) -> str:
    return "\n".join(_SPACES.sub("\t", line.strip()) for line in text.split("\n"))
