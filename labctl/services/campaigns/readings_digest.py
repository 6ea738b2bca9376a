"""A digest of the readings of a campaign: equal only where every reading is, bit for bit."""

from __future__ import annotations

import hashlib

import numpy as np

from labctl.answers.wire_logs import ReadingsDigest
from labctl.store import Store


def readings_digest(store: Store, campaign: int) -> ReadingsDigest:
    """Return the digest of all complete data sets of a campaign, unit by unit, and how many readings these are.

    It covers every column of a recording, with the times of the readings. Raises NotFound.
    """
    sha256, sets, readings = hashlib.sha256(), 0, 0
    for gyro, recording in sorted(store.campaigns.get(campaign).recordings.items()):
        sha256.update(f"{gyro}\n".encode())
        for number, columns in store.recordings.iter_datasets(recording):
            sha256.update(f"{number}\n".encode())
            sets += 1
            readings += len(next(iter(columns.values()), ()))
            for name, values in sorted(columns.items()):
                sha256.update(f"{name} {values.dtype.str}\n".encode())
                sha256.update(np.ascontiguousarray(values).tobytes())
    return ReadingsDigest(sha256=sha256.hexdigest(), datasets=sets, readings=readings)
