"""A residual that is no larger than what the coarse steps of the output leave: its cause is quantization."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.criticism.residuals import Residuals
from labctl.fitting.criticism.verdict import Verdict
from labctl.json_types.criticism import Advice

#: A residual up to this many times what the steps leave in a mean (or of another axis its noise) is theirs.
STEPS_LEAVE = 1.5
QUANTIZATION = "quantization"
NO_CORRECTION = Advice(
    effect=QUANTIZATION, add=False, why="no calibration corrects what the steps of an output leave out",
    before_dps=None, after_dps=None,
)  # fmt: skip


def with_quantization(verdict: Verdict, data: ReducedRecording, left: Mapping[str, Residuals]) -> Verdict:
    """Return the verdict, or quantization in place of another cause where no axis leaves more than its steps do.

    The catalogue's effect of that name is a law of raw codes, and competes where these are logged.
    """
    if verdict.form not in {"unexplained", "missing", "ambiguous"} or not data.steps or not left:
        return verdict
    for axis, residuals in left.items():
        step = data.steps.get(axis)
        most = STEPS_LEAVE * (step["left_dps"] if step else float(np.sqrt(np.mean(residuals.floor_dps**2))))
        if float(np.sqrt(np.mean(residuals.means**2))) > most:
            return verdict
    return Verdict("missing", ((QUANTIZATION,),), axes={QUANTIZATION: tuple(data.steps)})
