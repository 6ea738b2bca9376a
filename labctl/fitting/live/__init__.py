"""Calibration while a person turns the unit: what the readings so far determine, and which pose is missing."""

from labctl.fitting.live.calibration import LiveCalibration
from labctl.fitting.live.state import LiveCoefficient, LiveState, PoseRequest
from labctl.fitting.live.target import MOST_POSES, Target

__all__ = ["MOST_POSES", "LiveCalibration", "LiveCoefficient", "LiveState", "PoseRequest", "Target"]
