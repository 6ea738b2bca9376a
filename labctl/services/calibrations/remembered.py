"""What a version remembers of the temperature in use: the state that its consumer carries from sample to sample."""

from __future__ import annotations

from labctl.calibration import Calibration
from labctl.fitting.models.memory import split_memory
from labctl.services.schemas.calibrations import Follower


def remembered_by(calibration: Calibration) -> list[Follower]:
    """Return the elements that follow the temperature in the use of a version; none of one without memory."""
    _, memory = split_memory(calibration.fitted, calibration.axes)
    return [
        Follower(
            kind=each.kind, parameter=each.parameter, unit="s" if each.kind == "lag" else "K",
            cooling_s=each.cooling_s, is_curved=each.part == "curved",
            reference_c=each.reference_c if each.part == "curved" else None,
            size=dict(zip(calibration.axes, each.size.tolist(), strict=True)),
            scale=None if each.scale is None else dict(zip(calibration.axes, each.scale.tolist(), strict=True)),
        )
        for each in (memory.followers if memory is not None else ())
    ]  # fmt: skip
