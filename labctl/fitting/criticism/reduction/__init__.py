"""Reduction of a recording for criticism: a few numbers per data set that keep what its mean throws away.

Within each data set an orthonormal basis is built from a constant, time, a start transient and waves in the table
angle; the readings' coordinates in it are kept. For white noise this loses nothing that an effect of the catalogue
could use. Slow regressors are evaluated at a few nodes per data set and brought to the same coordinates.
"""

from labctl.fitting.criticism.reduction.basis import MIN_INDEPENDENT_SHARE, STEP_LINES
from labctl.fitting.criticism.reduction.outliers import OUTLIER
from labctl.fitting.criticism.reduction.points import reduce_points
from labctl.fitting.criticism.reduction.profile import reduce_profile
from labctl.fitting.criticism.reduction.reduced_recording import ReducedRecording
from labctl.fitting.criticism.reduction.samples import reduce_samples
from labctl.fitting.data.temperature.channel import with_temperature
from labctl.recording import Recording
from labctl.recording.verification import fitted_part

__all__ = ["MIN_INDEPENDENT_SHARE", "OUTLIER", "STEP_LINES", "ReducedRecording", "reduce_recording"]


def reduce_recording(recording: Recording, *, outliers: bool = True) -> ReducedRecording:
    """Return a recording reduced; points and turns have their means only. Without `outliers` every reading counts.

    What was measured to verify a calibration is left out. Raises NotEnoughData where the recording has no temperature.
    """
    recording = with_temperature(fitted_part(recording))
    if recording.info.motion == "profile" and "t_s" in recording.columns:
        return reduce_profile(recording)
    if recording.info.kind == "points" or recording.info.motion == "turns":
        return reduce_points(recording)
    return reduce_samples(recording, outliers=outliers)
