"""A format of calibration files, as an entry point of the group `labctl.exports` gives it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from labctl.calibration import Calibration


@dataclass(frozen=True)
class Format:
    """A consumer's format: its title on a page, and the suffix of its files."""

    title: str
    media_type: str
    suffix: str
    write: Callable[[Calibration], bytes]  #: raises BadInput for a model that the format cannot express
