"""Coverage of a stored recording: the range of its readings, as a fit takes it for its validity."""

from __future__ import annotations

import numpy as np

from labctl.answers.inspection import RecordingInspection
from labctl.fitting.data.covered import Covered, covered_by
from labctl.fitting.data.earth_rate import up_rate_dps
from labctl.recording import Recording
from labctl.recording.verification import is_marked


def covered_of(inspection: RecordingInspection, points: Recording) -> Covered | None:
    """Return what the readings of a recording cover, as far as they are fitted; None where it has none.

    `points` are its means: what was measured to verify a calibration does not widen the range of one.
    """
    aside = set(np.asarray(points.columns["dataset"])[is_marked(points)].tolist()) if points.columns else set[int]()
    covered = [place for place, number in enumerate(inspection.dataset) if number not in aside]
    if not covered:
        return None
    low = [temperature_c for place in covered if (temperature_c := inspection.temperature_low_c[place]) is not None]
    high = [temperature_c for place in covered if (temperature_c := inspection.temperature_high_c[place]) is not None]
    span = (min(low), max(high)) if low and high else (None, None)
    rates = np.asarray(inspection.rate_low_dps)[covered], np.asarray(inspection.rate_high_dps)[covered]
    return covered_by(rates, np.asarray(inspection.position)[covered], span, up_rate_dps(points.info))
