"""Result of a calibration by hand: the model with its coefficients, the error figures, and what is said beside it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from labctl.answers.poses import PosesJson
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.numeric.least_squares import Solution


@dataclass(frozen=True)
class PosesFit:
    """A model fitted to a recording in poses.

    The error figures are those of gravity's direction at the end of each used move, divided by how long the move took:
    root mean square of two components, deg/s.
    """

    fitted: FittedModel
    raw_rms_dps: float
    rms_dps: float
    heldout_rms_dps: float
    noise_floor_dps: float
    temperature_c: tuple[float | None, float | None]  #: of the readings; None without a thermometer
    rate_dps: tuple[float, float]  #: true rates of the used moves, over all axes
    solutions: Mapping[str, Solution]  #: axis -> bias over the rests, with its noise
    poses: PosesJson
