"""Work on many units: jobs that fit or criticise them, what came of each unit, and the report on a type."""

from __future__ import annotations

from labctl.answers.fleet import (
    FleetCancelRequest,
    FleetJobRequest,
    FleetJobResponse,
    FleetReportRequest,
    FleetReportResponse,
    FleetUnitResponse,
    FleetUnitState,
)
from labctl.client.connection import ClientPart
from labctl.service_connection import query_string


class FleetMethods(ClientPart):
    """Requests about many units at once."""

    def start_fleet_job(self, request: FleetJobRequest) -> FleetJobResponse:
        """Begin to fit or criticise many units, as `request.kind` says; returns at once.

        The service carries the job out. What is written is kept once: the same request goes on where a job was
        cancelled or interrupted.
        """
        return self._ask("/api/fleet/jobs", request, FleetJobResponse)

    def fleet_jobs(self, *, limit: int | None = None) -> list[FleetJobResponse]:
        """Return every job, newest first; at most `limit`."""
        return self._connection.get_list(f"/api/fleet/jobs{query_string(limit=limit)}", FleetJobResponse)

    def fleet_job(self, job: int) -> FleetJobResponse:
        """Return how far a job is, what it has cost, and how long it will still take."""
        return self._connection.get(f"/api/fleet/jobs/{job}", FleetJobResponse)

    def fleet_units(
        self, job: int, *, state: FleetUnitState | None = None, search: str = "", limit: int | None = None
    ) -> list[FleetUnitResponse]:
        """Return what came of each unit of a job, by serial number; at most `limit`.

        With `state` those in this state, with `search` those whose serial number holds it.
        """
        query = query_string(state=state, search=search, limit=limit)
        return self._connection.get_list(f"/api/fleet/jobs/{job}/units{query}", FleetUnitResponse)

    def cancel_fleet_job(self, job: int, reason: str, *, by: str = "") -> FleetJobResponse:
        """End a job before it is done; what was written stays."""
        return self._ask(f"/api/fleet/jobs/{job}/cancel", FleetCancelRequest(by=by, reason=reason), FleetJobResponse)

    def fleet_report(self, request: FleetReportRequest) -> FleetReportResponse:
        """Return what the units of a type have in common, which of them differ, and what their model is missing."""
        return self._connection.get(
            "/api/fleet/report", FleetReportResponse, **request.model_dump(exclude_defaults=True)
        )
