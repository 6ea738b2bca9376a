"""Coverage of a stored recording: the range of its readings, as a fit takes it for its validity."""

from __future__ import annotations

import numpy as np

from labctl.fitting.data.covered import Covered, covered_by
from labctl.fitting.data.earth import up_rate_dps
from labctl.recording import RecordingInfo
from labctl.services.schemas.warnings import RecordingInspection


def covered_of(found: RecordingInspection, info: RecordingInfo) -> Covered | None:
    """Return what the readings of a recording cover; None where it has none."""
    low = [value for value in found.temperature_low_c if value is not None]
    high = [value for value in found.temperature_high_c if value is not None]
    if not found.dataset:
        return None
    span = (min(low), max(high)) if low and high else (None, None)
    rates = np.asarray(found.rate_low_dps), np.asarray(found.rate_high_dps)
    return covered_by(rates, np.asarray(found.position), span, up_rate_dps(info))
