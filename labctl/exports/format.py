"""A format of calibration files, as an entry point of the group `labctl.exports` gives it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from labctl.fitting.numeric.rounding import at_most


@dataclass(frozen=True)
class Loss:
    """What a format does not carry of a calibration, and its largest size over the calibrated range."""

    what: str
    size: float | None = None  #: None: it is not known, or has none
    unit: str = "deg/s"

    @property
    def text(self) -> str:
        """One line, plain ASCII."""
        return self.what if self.size is None else f"{self.what}: up to {at_most(self.size):.3g} {self.unit}"


@dataclass(frozen=True)
class Written:
    """A file, what it lost, and how far its consumer's formula is from labctl's in what it carries, deg/s."""

    content: bytes
    losses: tuple[Loss, ...] = ()
    differs_dps: float | None = None


@dataclass(frozen=True)
class Format:
    """A consumer's format: its title on a page, and the suffix of its files.

    `write` gets the calibration, and as second argument the options (name -> text) where the format has any; it raises
    BadInput for what the format cannot express. One with `needs_noise` gets the options `noise_dps_rthz` and
    `walk_dps_s_rthz` from the unit's Allan deviation where the user gives none.
    """

    title: str
    media_type: str
    suffix: str
    write: Callable[..., bytes | Written]
    options: Mapping[str, str] = field(default_factory=dict)  #: name -> what it is, its unit and default
    needs_noise: bool = False
