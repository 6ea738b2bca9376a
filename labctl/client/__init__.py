"""A client of a labctl service: calibrations by serial number, recordings, fits and campaigns.

Every method sends one HTTP request and returns a typed answer. Three errors are common to all of them:
`ServiceRefused` (the service refuses the request and says why), `labctl.errors.StoreError` (it does not answer) and
`pydantic.ValidationError` (a value of a request is wrong; nothing was sent).
"""

from __future__ import annotations

from labctl.answers.calibrations import CalibrationRow, FitRequest, FitResponse
from labctl.answers.campaigns import CampaignRequest, CampaignResponse, EventResponse, ResumeRequest
from labctl.answers.certification import CalibrationStateResponse
from labctl.answers.design import DesignRequest, DesignResponse
from labctl.answers.diagnosis import ConfirmExperimentRequest, DiagnosisRequest, DiagnosisResponse
from labctl.answers.fixed_coefficients import FixedCoefficients
from labctl.answers.fleet import (
    FleetJobRequest,
    FleetJobResponse,
    FleetReportRequest,
    FleetReportResponse,
    FleetUnitResponse,
)
from labctl.answers.points import FigurePointResponse, PointResponse
from labctl.answers.recordings import AllanResponse, ImportResponse, RecordingResponse, TraceResponse
from labctl.answers.residuals import ResidualsResponse
from labctl.answers.schedule import ScheduledResponse
from labctl.answers.units import TrendResponse, UnitResponse
from labctl.bundle import Bundle
from labctl.client.calibrations import CalibrationFile
from labctl.client.client import Client
from labctl.errors import CalibrationWithdrawn
from labctl.service_connection import ServiceRefused
from labctl.withdrawal import Withdrawn

__all__ = [
    "AllanResponse",
    "Bundle",
    "CalibrationFile",
    "CalibrationRow",
    "CalibrationStateResponse",
    "CalibrationWithdrawn",
    "CampaignRequest",
    "CampaignResponse",
    "Client",
    "ConfirmExperimentRequest",
    "DesignRequest",
    "DesignResponse",
    "DiagnosisRequest",
    "DiagnosisResponse",
    "EventResponse",
    "FigurePointResponse",
    "FitRequest",
    "FitResponse",
    "FixedCoefficients",
    "FleetJobRequest",
    "FleetJobResponse",
    "FleetReportRequest",
    "FleetReportResponse",
    "FleetUnitResponse",
    "ImportResponse",
    "PointResponse",
    "RecordingResponse",
    "ResidualsResponse",
    "ResumeRequest",
    "ScheduledResponse",
    "ServiceRefused",
    "TraceResponse",
    "TrendResponse",
    "UnitResponse",
    "Withdrawn",
]
