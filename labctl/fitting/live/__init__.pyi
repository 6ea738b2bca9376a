from labctl.fitting.live.calibration import LiveCalibration as LiveCalibration
from labctl.fitting.live.state import (
    LiveCoefficient as LiveCoefficient,
    LiveState as LiveState,
    PoseRequest as PoseRequest,
)
from labctl.fitting.live.target import MAX_POSES as MAX_POSES, Target as Target
