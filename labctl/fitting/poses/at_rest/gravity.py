"""Local gravity."""

from __future__ import annotations

import math

from labctl.recording import RecordingInfo

STANDARD_GRAVITY = 9.80665  #: m/s2, of one g


def local_gravity_g(info: RecordingInfo) -> float:
    """Return the local gravity in g: by latitude, at sea level (WGS 84, Somigliana); 1 where the latitude is not known.

    Only the accelerometer's scale factors depend on it: the gyro's coefficients go by directions.
    """
    if info.latitude_deg is None:
        return 1.0
    sine2 = math.sin(math.radians(info.latitude_deg)) ** 2
    return 9.7803253359 * (1 + 0.00193185265241 * sine2) / math.sqrt(1 - 0.00669437999014 * sine2) / STANDARD_GRAVITY
