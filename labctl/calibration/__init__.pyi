from labctl.calibration.building import build_calibration as build_calibration
from labctl.calibration.certification import (
    CalibrationWarning as CalibrationWarning,
    Certification as Certification,
    with_certification as with_certification,
)
from labctl.calibration.document import (
    Calibration as Calibration,
    SCHEMA as SCHEMA,
    read_calibration as read_calibration,
)
from labctl.canonical_json import canonical as canonical, hash_of as hash_of
