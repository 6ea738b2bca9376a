"""What of a damaged file could not be read: how much, where, and from which share on nothing useful is left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from labctl.errors import BadRecording

#: A file of which more than this share cannot be read is refused.
MAX_UNREAD = 0.5
#: Places that a sentence names.
SHOWN_PLACES = 3
TAKE_AGAIN = "copy the log again from where it was recorded, and check its size"


@dataclass(frozen=True)
class Unread:
    """Parts of a file that could not be read. `share` is of its bytes, rows or messages, 0 to 1."""

    share: float
    places: tuple[str, ...]  #: in words, in the order of the file
    is_cut: bool = False  #: whether the end is missing, so that more than `share` may be lost

    @property
    def text(self) -> str:
        """In words."""
        places_text = ", ".join(self.places[:SHOWN_PLACES])
        more = f" and {len(self.places) - SHOWN_PLACES} more places" if len(self.places) > SHOWN_PLACES else ""
        cut = "; its end is cut off, and what followed is lost" if self.is_cut else ""
        return f"{share_text(self.share)} of the file could not be read: {places_text}{more}{cut}"


def share_text(share: float) -> str:
    """Return a share in percent, never as 0 where something is lost."""
    return f"{100 * share:.2g} %" if share >= 1e-4 else "less than 0.01 %"


def refuse_unread(path: Path, unread: Unread | None, advice: str = TAKE_AGAIN) -> None:
    """Raise BadRecording for a file of which too much could not be read."""
    if unread is not None and unread.share > MAX_UNREAD:
        raise BadRecording(
            f"{path}: {unread.text}; at most {MAX_UNREAD:.0%} may be missing from a file that is imported; {advice}"
        )


def of_several(parts: Sequence[Unread | None]) -> Unread | None:
    """Return what could not be read of several files together, its share that of the worst."""
    present = [part for part in parts if part is not None]
    if not present:
        return None
    places = tuple(place for part in present for place in part.places)
    return Unread(max(part.share for part in present), places, any(part.is_cut for part in present))
