"""What the criticisms of units show of every effect: packed by workers, added up by the coordinator, kept in parts.

A part holds the sums over some units of one type and error model; it counts while the criticism of each of its units
is the newest one. Correlations travel as 32-bit floats, of which the sums need no more.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism import CandidateEstimates, EstimatedShape
from labctl.fitting.fleet.type_sums import AxisSums, TypeSums
from labctl.store import FleetEvidence

#: Units of a part: a criticism made anew makes its part count no more, and a process that is killed loses one part.
UNITS_OF_A_PART = 50
SUMS = ("units", "squares", "directions", "information", "products", "squared_weights")
TOTALS = ("whole", "all_directions")


@dataclass(frozen=True)
class PackedEstimates:
    """The estimates of one output axis; the correlations as the upper triangle in 32-bit floats."""

    shapes: tuple[EstimatedShape, ...]
    z: NDArray[np.float64]
    u: NDArray[np.float64]
    triangle: NDArray[np.float32]

    @property
    def overlap(self) -> NDArray[np.float64]:
        """The correlations, (K, K)."""
        k = len(self.z)
        overlap = np.zeros((k, k))
        overlap[np.triu_indices(k)] = self.triangle
        return np.asarray(overlap + np.triu(overlap, 1).T)


def packed(estimates: CandidateEstimates) -> PackedEstimates:
    """Return estimates in a form that takes a quarter of the room."""
    triangle = estimates.overlap[np.triu_indices(len(estimates.z))].astype(np.float32)
    return PackedEstimates(estimates.shapes, estimates.z, estimates.u, triangle)


@dataclass(frozen=True)
class UnitEstimates:
    """What the criticism of one unit shows of every effect, by output axis."""

    type: str  #: model of the unit
    model: str  #: error model of its version
    bench: str  #: empty: the recording was imported
    axes: Mapping[str, PackedEstimates]


@dataclass
class _Part:
    sums: TypeSums = field(default_factory=TypeSums)
    serials: list[str] = field(default_factory=list)


class EvidenceParts:
    """The parts of a job that are being added up."""

    def __init__(self) -> None:
        self._parts: dict[tuple[str, str], _Part] = {}

    def add(self, serial: str, estimates: UnitEstimates) -> FleetEvidence | None:
        """Add a unit; returns a part that is to be kept now, None while there is none."""
        part = self._parts.setdefault((estimates.type, estimates.model), _Part())
        axes = {
            axis: CandidateEstimates(each.shapes, each.z, each.u, each.overlap) for axis, each in estimates.axes.items()
        }
        part.sums.add(axes, estimates.bench)
        part.serials.append(serial)
        return self._taken(estimates.type, estimates.model) if len(part.serials) >= UNITS_OF_A_PART else None

    def rest(self) -> list[FleetEvidence]:
        """Return the parts that are not kept yet."""
        return [self._taken(*key) for key in list(self._parts)]

    def _taken(self, type_: str, model: str) -> FleetEvidence:
        part = self._parts.pop((type_, model))
        return FleetEvidence(type_, model, part.serials, content_of(part.sums))


def content_of(sums: TypeSums) -> bytes:
    """Return sums as bytes."""
    arrays: dict[str, NDArray[np.generic]] = {}
    head: list[dict[str, object]] = []
    for bench, axes in sums.benches.items():
        for axis, each in axes.items():
            number = len(head)
            shapes = [[s.effect, s.shape, list(s.names), list(s.units), s.is_exact] for s in each.shapes]
            head.append({"bench": bench, "axis": axis, "shapes": shapes, "starts": each.starts})
            arrays |= {f"{number}.{name}": np.asarray(getattr(each, name)) for name in SUMS + TOTALS}
    text = json.dumps({"units": sums.units, "axes": head}, sort_keys=True).encode()
    file = io.BytesIO()
    np.savez_compressed(file, head=np.frombuffer(text, dtype=np.uint8), **arrays)  # type: ignore[arg-type]
    return file.getvalue()


def sums_in(content: bytes) -> TypeSums:
    """Return the sums in bytes that `content_of` made; those of an older program are not `complete`."""
    sums = TypeSums()
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        head = json.loads(arrays["head"].tobytes())
        sums.units = head["units"]
        for number, each in enumerate(head["axes"]):
            shapes = [
                EstimatedShape(effect, shape, tuple(names), tuple(units), exact)
                for effect, shape, names, units, exact in each["shapes"]
            ]
            axis = AxisSums(shapes, {s.key: i for i, s in enumerate(shapes)}, list(each["starts"]))
            for name in SUMS:
                setattr(axis, name, arrays[f"{number}.{name}"])
            for name in TOTALS:
                setattr(axis, name, float(arrays.get(f"{number}.{name}", np.nan)))
            sums.benches.setdefault(each["bench"], {})[each["axis"]] = axis
    return sums
