"""The evidence of one unit as bytes, for a database: small, where other units of the same schedule have the overlap.

Estimates and uncertainties are kept to single precision. The overlap of the regressors is that of the schedule and the
model; units of one `design` have it in common up to their noise, and it is stored with one of them.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput
from labctl.fitting.criticism import CandidateEstimates, EstimatedShape
from labctl.fitting.fleet.type_evidence import UnitEvidence

#: Axis -> (K, K), see `CandidateEstimates.overlap`.
Overlaps = Mapping[str, NDArray[np.float64]]


def design_of(unit: UnitEvidence) -> str:
    """Return a name for the shapes that a unit was compared with: equal names, equal places of every coefficient."""
    shapes = {axis: [[*shape.key[:2], list(shape.names)] for shape in each.shapes] for axis, each in unit.axes.items()}
    return hashlib.sha256(json.dumps(shapes, sort_keys=True).encode()).hexdigest()[:16]


def to_bytes(unit: UnitEvidence, *, with_overlap: bool) -> bytes:
    """Return the evidence of a unit; without its overlap it needs that of another unit of the same design."""
    head = {
        "serial_number": unit.serial_number, "bench": unit.bench, "design": design_of(unit),
        "axes": {
            axis: [[s.effect, s.shape, list(s.names), list(s.units), s.is_exact] for s in each.shapes]
            for axis, each in unit.axes.items()
        },
    }  # fmt: skip
    arrays: dict[str, NDArray[np.generic]] = {"head": np.frombuffer(json.dumps(head).encode(), dtype=np.uint8)}
    for axis, each in unit.axes.items():
        arrays |= {f"{axis}_z": each.z.astype(np.float32), f"{axis}_u": each.u.astype(np.float32)}
        if with_overlap:
            arrays[f"{axis}_overlap"] = each.overlap.astype(np.float32)
    file = io.BytesIO()
    np.savez_compressed(file, allow_pickle=False, **arrays)
    return file.getvalue()


def from_bytes(content: bytes, overlaps: Mapping[str, Overlaps] | None = None) -> UnitEvidence:
    """Return the evidence of a unit; `overlaps` are those of other units, by design.

    Raises BadInput where the overlap is neither in it nor in `overlaps`.
    """
    with np.load(io.BytesIO(content), allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    head = json.loads(arrays["head"].tobytes())
    axes = {}
    for axis, shapes in head["axes"].items():
        own = arrays.get(f"{axis}_overlap")
        overlap = own if own is not None else (overlaps or {}).get(head["design"], {}).get(axis)
        if overlap is None:
            raise BadInput(
                f"evidence of {head['serial_number']}, axis {axis}: it has no overlap of its regressors, nor has any "
                f"unit of its design {head['design']}; give that of one, or run `labctl criticise` again"
            )
        axes[axis] = CandidateEstimates(
            tuple(EstimatedShape(effect, shape, tuple(names), tuple(units), is_exact)
                  for effect, shape, names, units, is_exact in shapes),
            arrays[f"{axis}_z"].astype(np.float64), arrays[f"{axis}_u"].astype(np.float64),
            np.asarray(overlap, dtype=np.float64),
        )  # fmt: skip
    return UnitEvidence(head["serial_number"], axes, head["bench"])
