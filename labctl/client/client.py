"""A client of one labctl service."""

from __future__ import annotations

import httpx

from instruments.clock import Clock, SystemClock
from labctl.client.calibrations import CalibrationMethods
from labctl.client.campaigns import CampaignMethods
from labctl.client.figures import FigureMethods
from labctl.client.fleet import FleetMethods
from labctl.client.recordings import RecordingMethods
from labctl.closing import ClosedAtEnd
from labctl.service_connection import TIMEOUT_S, ServiceConnection

#: Address of `labctl serve` without options.
DEFAULT_URL = "http://127.0.0.1:8420"


class Client(CalibrationMethods, FigureMethods, RecordingMethods, CampaignMethods, FleetMethods, ClosedAtEnd):
    """A connection to one service, to be closed or used in a `with` statement.

    `url` is the address of the service. `api_key` defaults to the environment variable `LABCTL_KEY`; a service on
    loopback needs none unless it was started with `--require-keys`. `timeout_s` bounds each answer, in seconds, and for
    how long a service that computes for others (429) is asked again, each time when its `Retry-After` says.
    """

    def __init__(
        self,
        url: str = DEFAULT_URL,
        *,
        api_key: str | None = None,
        timeout_s: float = TIMEOUT_S,
        transport: httpx.BaseTransport | None = None,
        clock: Clock | None = None,
    ) -> None:
        self._clock = clock or SystemClock()
        self._connection = ServiceConnection(url, api_key, timeout_s=timeout_s, transport=transport, clock=self._clock)

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()
