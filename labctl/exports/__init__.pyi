from labctl.exports.format import Format as Format, Loss as Loss, Written as Written
from labctl.exports.registry import (
    FORMATS as FORMATS,
    export_calibration as export_calibration,
    export_formats as export_formats,
    format_named as format_named,
    written_calibration as written_calibration,
)
