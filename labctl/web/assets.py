"""The files of the pages as they travel: under addresses that change with their content, compressed, cached for good.

`/static/<release>/js/main.js` is kept by browsers for a year and never asked for again (RFC 9111, RFC 8246). The
release is a digest of all files: pages of the next release name other addresses, and modules that import one another by
relative addresses follow. `/static/js/main.js` is the same file, revalidated on each request.
"""

from __future__ import annotations

import gzip
import mimetypes
import sys
import threading
from collections.abc import Iterable
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

from labctl.web.bundles import Bundles

#: Names of content codings (IANA, RFC 9659) in the order in which they are preferred, and what makes them. The level is
#: the highest that takes less than 0.2 s for 5 MB.
CODINGS = {"zstd": lambda body: zstd.compress(body, 12), "gzip": lambda body: gzip.compress(body, 9, mtime=0)}
#: A year, the longest that browsers keep.
IMMUTABLE = "public, max-age=31536000, immutable"
#: Revalidated on each request, answered 304 while unchanged.
REVALIDATED = "no-cache"
#: Files shorter than a network packet gain nothing.
MIN_COMPRESSED_BYTES = 1400


@dataclass(frozen=True)
class Asset:
    """One answer for a file: `body` in `coding` (empty: as it is), of `media_type`; `etag` is strong, one a coding."""

    body: bytes
    coding: str
    media_type: str
    etag: str

    @classmethod
    def of(cls, body: bytes, media_type: str, coding: str = "") -> Asset:
        """Return a body as an answer, compressed where `coding` is given and the body is long enough to gain by it."""
        digest = sha256(body).hexdigest()[:32]
        if coding and len(body) >= MIN_COMPRESSED_BYTES:
            return cls(CODINGS[coding](body), coding, media_type, f'"{digest}-{coding}"')
        return cls(body, "", media_type, f'"{digest}"')


class Assets:
    """The files of a folder, others by name, and bundles of them; read when first asked for, and again when changed.

    `heads` are lines that some files are served with at their beginning. Names are relative addresses with slashes.
    Nothing outside `folder` and `others` is ever opened.
    """

    def __init__(self, folder: Path, others: dict[str, Path], heads: dict[str, bytes] | None = None) -> None:
        own_paths = {path.relative_to(folder).as_posix(): path for path in sorted(folder.rglob("*")) if path.is_file()}
        self._paths = own_paths | others
        self._heads = heads or {}
        self._kept: dict[tuple[str, str], tuple[str, Asset]] = {}
        self._digests: dict[str, tuple[str, str]] = {}
        self._lock = threading.Lock()
        self._release = ""
        self.release()

    def release(self) -> str:
        """Return the part of addresses that stands for the content of all files of now: 12 hexadecimal digits."""
        digests = "\n".join(f"{name} {self._digest(name)}" for name in sorted(self._paths))
        release = sha256(digests.encode()).hexdigest()[:12]
        if release != self._release:
            self._release, self.bundles = release, Bundles(lambda name: self._paths[name].read_text(encoding="utf-8"))
        return release

    def _digest(self, name: str) -> str:
        """Return the digest of a file; size and time alone do not tell, as installers may give all files one time."""
        state = _state(self._paths[name])
        known = self._digests.get(name)
        if known is None or known[0] != state:
            known = self._digests[name] = (state, sha256(self._paths[name].read_bytes()).hexdigest())
        return known[1]

    def split(self, address: str) -> tuple[str, bool]:
        """Return the name in an address below `/static/`, and whether it is of this release, so never changes.

        An open page of an earlier release goes on to ask for its own files: it gets those of now, revalidated.
        """
        first, slash, rest = address.partition("/")
        if slash and not self._has(address) and self._has(rest):
            return rest, first == self._release
        return address, False

    def _has(self, name: str) -> bool:
        return name in self._paths or Bundles.source_of(name) in self._paths

    def get(self, name: str, accepted: Iterable[str]) -> Asset | None:
        """Return a file in the best of the accepted codings (`accepted_codings`); None for no such file."""
        if not self._has(name):
            return None
        wanted = next((coding for coding in CODINGS if coding in set(accepted)), "")
        with self._lock:  # of two first visitors one compresses
            path = self._paths.get(name)
            state = self._release if path is None else _state(path)
            kept = self._kept.get((name, wanted))
            if kept is None or kept[0] != state:
                body = self.bundles.content(name).encode() if path is None else path.read_bytes()
                body = self._heads.get(name, b"") + body
                kind = mimetypes.guess_type(name)[0] or "application/octet-stream"
                kept = self._kept[name, wanted] = (state, Asset.of(body, kind, wanted))
        return kept[1]


def accepted_codings(header: str) -> set[str]:
    """Return the codings of an Accept-Encoding header that a client takes (RFC 9110, 12.5.3): those without `q=0`."""
    parts = [part.strip().lower().partition(";") for part in header.split(",")]
    return {coding.strip() for coding, _, weight in parts if weight.replace(" ", "") not in ("q=0", "q=0.0", "q=0.00")}


def _state(path: Path) -> str:
    status = path.stat()
    return f"{status.st_size} {status.st_mtime_ns}"
