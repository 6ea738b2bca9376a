"""Intervals between the certified calibrations of a unit, and the rates at which its errors changed over them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import timedelta
from itertools import pairwise

import numpy as np

from labctl.calibration import Calibration, read_calibration
from labctl.errors import BadCalibrationFile
from labctl.fitting.numeric.arrays import Array
from labctl.services.calibrations.error_grid import ErrorGrid
from labctl.store import CertifiedVersion, Store

YEAR_S = timedelta(days=365.25).total_seconds()


def versions_apart(
    versions: Sequence[CertifiedVersion], last: CertifiedVersion, least: timedelta
) -> list[CertifiedVersion]:
    """Return the versions up to one by the times of their measurements, rising; that one is the last.

    Of versions that lie closer together than `least`, or share a recording with the one before, the first counts. A
    version without a date of its measurements is left out, and alone where it is the last.
    """
    earlier = [version for version in versions if version.version != last.version]
    apart: list[CertifiedVersion] = []
    for _, _, each in sorted((one.measured_at, one.version, one) for one in earlier if one.measured_at is not None):
        if (not apart or _is_apart(apart[-1], each, least)) and _is_apart(each, last, least):
            apart.append(each)
    return [*apart, last]


def _is_apart(before: CertifiedVersion, after: CertifiedVersion, least: timedelta) -> bool:
    if before.measured_at is None or after.measured_at is None:
        return False
    return after.measured_at - before.measured_at >= least and not before.recordings & after.recordings


def calibrations_of(store: Store, versions: Sequence[CertifiedVersion]) -> dict[int, Calibration]:
    """Return number of a calibration -> its content. Raises BadCalibrationFile, which names unit and version."""
    documents = store.certified_versions.documents([version.id for version in versions])
    calibrations = {}
    for version in versions:
        try:
            calibrations[version.id] = read_calibration(documents[version.id])
        except BadCalibrationFile as error:
            raise BadCalibrationFile(
                f"{version.serial} version {version.version}, which the drift until the due date is computed from: "
                f"{error}; "
                "run `labctl check`"
            ) from error
    return calibrations


def rates_of(
    versions: Sequence[CertifiedVersion], calibrations: Mapping[int, Calibration], grid: ErrorGrid
) -> tuple[Array, Array]:
    """Return the changes of the errors by their years, (intervals, places) deg/s per year, and the years, (intervals,).

    NaN where one of the versions is not valid; an interval between versions that cannot be compared is left out.
    """
    errors = [grid.errors_dps(calibrations[version.id]) for version in versions]
    rates, years = [], []
    for (before, old), (after, new) in pairwise(zip(versions, errors, strict=True)):
        if old is not None and new is not None and before.measured_at and after.measured_at:
            years.append((after.measured_at - before.measured_at).total_seconds() / YEAR_S)
            rates.append((new - old) / years[-1])
    return np.stack(rates) if rates else np.zeros((0, 0)), np.asarray(years, dtype=np.float64)
