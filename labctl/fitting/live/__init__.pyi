from labctl.fitting.live.calibration import LiveCalibration as LiveCalibration
from labctl.fitting.live.state import (
    LiveCoefficient as LiveCoefficient,
    LiveState as LiveState,
    PoseRequest as PoseRequest,
)
from labctl.fitting.live.target import MOST_POSES as MOST_POSES, Target as Target
