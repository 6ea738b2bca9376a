"""A calibration as CSV: the error to subtract from the output, over output and temperature."""

from __future__ import annotations

import numpy as np

from labctl.calibration import Calibration
from labctl.compensator import Compensator
from labctl.errors import BadInput
from labctl.exports.format import Format

RATES, TEMPERATURES = 21, 11
HEADER = "axis,output_dps,temperature_c,error_dps"


def write(calibration: Calibration) -> bytes:
    """Return the table; raises BadInput for a model that depends on more than output and temperature."""
    compensator = Compensator(calibration)
    if compensator.needs:
        raise BadInput(f"format lookup-csv: the model needs {', '.join(compensator.needs)} too; use json")
    slow, fast = calibration.rate_dps
    outputs = np.linspace(slow, fast, RATES) if np.isfinite([slow, fast]).all() else np.zeros(1)
    lines = [HEADER]
    for temperature_c in np.linspace(*calibration.temperature_c, TEMPERATURES):
        raw = np.repeat(outputs[:, None], len(calibration.axes), axis=1)
        error = raw - compensator.compensate(raw, float(temperature_c)).rate_dps
        for column, axis in enumerate(calibration.axes):
            lines += [
                f"{axis},{output:.9g},{temperature_c:.6g},{each:.9g}"
                for output, each in zip(outputs, error[:, column], strict=True)
            ]
    return ("\n".join(lines) + "\n").encode("ascii")


FORMAT = Format("Look-up table", "text/csv", "csv", write)
