"""When a live calibration is complete."""

from __future__ import annotations

import math
from dataclasses import dataclass

from labctl.errors import BadInput
from labctl.fitting.live.directions import DIRECTIONS
from labctl.fitting.poses.at_rest.accelerometer import MIN_POSES

#: Poses that can be asked for: six faces, twelve edges, eight corners of a cube.
MAX_POSES = len(DIRECTIONS)
#: Least and longest rest that can be asked for, s: two windows of the search for rests, and no drift in it.
SHORTEST_REST_S, LONGEST_REST_S = 1.0, 60.0


@dataclass(frozen=True)
class Target:
    """The criterion: the asked poses are covered, and every expanded uncertainty U (k = 2) is within its limit.

    Raises BadInput for a limit that is not positive, and for poses or a rest outside of their range.
    """

    u: float = 1e-3  #: U of each scale factor and of each misalignment (rad), 1
    bias_dps: float | None = None  #: U of each bias, deg/s; None: no limit
    poses: int = 18  #: so many of the poses, in their order: faces, edges, corners
    rest_s: float = 2.0  #: a pose is covered by a rest of so long

    def __post_init__(self) -> None:
        for name, value in (("target", self.u), ("target-bias", self.bias_dps)):
            if value is not None and not (value > 0 and math.isfinite(value)):
                raise BadInput(f"--{name} {value:g}: an uncertainty must be above 0; give such as 0.001")
        if not MIN_POSES <= self.poses <= MAX_POSES:
            raise BadInput(
                f"--poses {self.poses}: give {MIN_POSES} to {MAX_POSES}; the accelerometer takes {MIN_POSES}, and "
                f"{MAX_POSES} are six faces, twelve edges and eight corners"
            )
        if not SHORTEST_REST_S <= self.rest_s <= LONGEST_REST_S:  # also true for NaN
            raise BadInput(f"--rest {self.rest_s:g} s: give {SHORTEST_REST_S:g} to {LONGEST_REST_S:g} s")
