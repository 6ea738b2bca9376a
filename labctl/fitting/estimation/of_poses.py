"""Calibration of a recording in poses, as every other fit gives it."""

from __future__ import annotations

from labctl.answers.fitted_model import AxisNoiseJson, FitEnvironment
from labctl.errors import BadInput
from labctl.fitting.data.noise_floor import correlation_times
from labctl.fitting.estimation.error_metrics import ErrorFigures
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.presets import POSES
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.numeric.least_squares import Solution
from labctl.fitting.poses.fit import fit_poses
from labctl.recording import Recording

#: Where the noise floor of a calibration by hand is from.
FLOOR_SOURCE = "noise of rests and moves"


@single_threaded
def of_poses(recording: Recording, model: str | None, effects: list[str]) -> FitResult:
    """Fit model `poses`, and no other, to a recording in poses.

    Raises BadInput for another model or motion, NotEnoughData where rests or turns do not determine it.
    """
    serial = recording.info.serial
    if model != POSES or effects:
        raise BadInput(
            f"{serial}: a recording of poses shows the direction of gravity before and after each turn, not the rate "
            f"during the turn; fit it with --model {POSES} and without added effects"
        )
    poses_fit = fit_poses(recording)
    error = ErrorFigures(
        poses_fit.raw_rms_dps, poses_fit.rms_dps, poses_fit.heldout_rms_dps, poses_fit.noise_floor_dps, FLOOR_SOURCE
    )
    return FitResult(
        poses_fit.fitted,
        error,
        poses_fit.temperature_c,
        poses_fit.rate_dps,
        {axis: _noise_json(solution) for axis, solution in poses_fit.solutions.items()},
        _environment(recording),
        poses=poses_fit.poses,
    )


def _noise_json(solution: Solution) -> AxisNoiseJson:
    return {
        "white_dps": solution.white_dps,
        "drift_dps": solution.drift.drift_dps,
        **correlation_times(solution.drift),
        "per_rate": 0.0,
        "covariance_scale": solution.scale,
    }


def _environment(recording: Recording) -> FitEnvironment:
    latitude = recording.info.latitude_deg
    if latitude is None:
        return {"earth_rate": "not subtracted, since the latitude is not known; included in the uncertainty of g_own"}
    return {
        "earth_rate": "the vertical part of the Earth's rate is subtracted from the rests; the horizontal part "
        "counts as noise",
        "latitude_deg": latitude,
    }
