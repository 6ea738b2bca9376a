"""Campaigns and diagnoses on the bench of a service: started, followed, and acted on."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import httpx
from httpx_sse import ServerSentEvent, connect_sse

from labctl.answers.base import Request
from labctl.answers.campaigns import (
    CampaignRequest,
    CampaignResponse,
    ConfirmRequest,
    EventResponse,
    ReasonRequest,
    ResumeRequest,
)
from labctl.answers.design import DesignRequest, DesignResponse
from labctl.answers.diagnosis import ConfirmExperimentRequest, DiagnosisRequest, DiagnosisResponse
from labctl.answers.schedule import ScheduledResponse
from labctl.client.connection import ClientPart, part
from labctl.service_connection import json_of, query_string, refusal

#: Pauses before `Client.watch` connects again, s; after the last one it gives up.
RECONNECT_AFTER_S = (1.0, 2.0, 4.0, 8.0, 15.0)
#: An event stream that is silent for longer is broken, s: the service sends a sign of life every 10 s.
SILENT_S = 30.0


class CampaignMethods(ClientPart):
    """Requests about campaigns and diagnoses."""

    def start_campaign(self, request: CampaignRequest) -> CampaignResponse | ScheduledResponse:
        """Start a campaign now, or enter it into the schedule when the request has `at` or `cron`.

        A bench that is not simulated needs `confirmed_by` and `checks`; without them ServiceRefused has the slug
        `start-not-confirmed`.
        """
        response = self._post("/api/campaigns", request)
        kind = ScheduledResponse if response.status_code == httpx.codes.ACCEPTED else CampaignResponse
        return kind.model_validate(json_of(response))

    def design_campaign(self, request: DesignRequest) -> DesignResponse:
        """Return the cheapest recipe that reaches an uncertainty on the service's bench, or the best within hours."""
        return self._ask("/api/designs", request, DesignResponse)

    def campaigns(self, *, search: str = "", limit: int | None = None) -> list[CampaignResponse]:
        """Return every campaign, newest first; at most `limit`.

        With `search` those whose recipe, bench, state or units' serial numbers hold it.
        """
        return self._connection.get_list(f"/api/campaigns{query_string(search=search, limit=limit)}", CampaignResponse)

    def campaign(self, campaign: int) -> CampaignResponse:
        """Return state, step, progress and temperatures of one campaign."""
        return self._connection.get(f"/api/campaigns/{campaign}", CampaignResponse)

    def watch(self, campaign: int, *, after: int = 0) -> Iterator[EventResponse | CampaignResponse]:
        """Yield the events of a campaign whose id is above `after`, and its status when it changes, until it ends.

        It also ends when the service stops, as the state in the last status shows. A connection that breaks is opened
        again after 1, 2, 4, 8 and 15 s and goes on behind the last event. Raises StoreError when the service stays
        silent.
        """
        pauses = iter(RECONNECT_AFTER_S)
        while True:
            try:
                for update in self._events(campaign, after):
                    after = update.id if isinstance(update, EventResponse) else after
                    pauses = iter(RECONNECT_AFTER_S)
                    yield update
                return
            except httpx.HTTPError as error:
                pause_s = next(pauses, None)
                if pause_s is None:
                    raise self._connection.silent(error) from error
                self._clock.sleep(pause_s)

    def pause(self, campaign: int, reason: str, *, by: str = "") -> CampaignResponse:
        """Ask a running campaign to hold after the present data set."""
        return self._act(campaign, "pause", ReasonRequest(reason=reason, by=by))

    def resume(self, campaign: int, request: ResumeRequest | None = None) -> CampaignResponse:
        """Continue a paused campaign, or resume one that was interrupted, failed or aborted."""
        return self._act(campaign, "resume", request or ResumeRequest())

    def abort(self, campaign: int, reason: str, *, by: str = "") -> CampaignResponse:
        """End a running campaign now, in the safe state; what was measured is kept.

        The answer comes within about a second; `wish` is `abort` until the campaign has ended.
        """
        return self._act(campaign, "abort", ReasonRequest(reason=reason, by=by))

    def confirm(
        self, campaign: int, prompt: str, *, by: str, confirmed: bool = True, again: bool = False, reason: str = ""
    ) -> CampaignResponse:
        """Answer the question with the id `prompt`. `confirmed=False`: it cannot be done, and the campaign ends.

        `again=True`: a turn by hand did not go well and is to be asked again.
        """
        answer = ConfirmRequest(prompt=prompt, by=by, confirmed=confirmed and not again, again=again, reason=reason)
        return self._act(campaign, "confirm", answer)

    def start_diagnosis(self, serial: str, request: DiagnosisRequest | None = None) -> DiagnosisResponse:
        """Run experiments on the service's bench until one missing effect is left; returns at once."""
        return self._on_diagnosis(f"/api/units/{part(serial)}/diagnoses", request or DiagnosisRequest())

    def diagnoses(self, serial: str) -> list[DiagnosisResponse]:
        """Return the diagnoses of a unit, newest first."""
        return self._connection.get_list(f"/api/units/{part(serial)}/diagnoses", DiagnosisResponse)

    def diagnosis(self, diagnosis: int) -> DiagnosisResponse:
        """Return a diagnosis with its rounds."""
        return self._connection.get(f"/api/diagnoses/{diagnosis}", DiagnosisResponse)

    def confirm_experiment(self, diagnosis: int, request: ConfirmExperimentRequest) -> DiagnosisResponse:
        """Confirm the experiment that waits for a person, or answer that it cannot be done."""
        return self._on_diagnosis(f"/api/diagnoses/{diagnosis}/confirm", request)

    def act_on_diagnosis(
        self, diagnosis: int, act: Literal["stop", "resume", "end"], reason: str, *, by: str = ""
    ) -> DiagnosisResponse:
        """Stop a diagnosis and abort its campaign, resume both, or end the diagnosis for good."""
        return self._on_diagnosis(f"/api/diagnoses/{diagnosis}/{act}", ReasonRequest(reason=reason, by=by))

    def _on_diagnosis(self, path: str, request: Request) -> DiagnosisResponse:
        return self._ask(path, request, DiagnosisResponse)

    def _act(self, campaign: int, act: str, request: Request) -> CampaignResponse:
        return self._ask(f"/api/campaigns/{campaign}/{act}", request, CampaignResponse)

    def _events(self, campaign: int, after: int) -> Iterator[EventResponse | CampaignResponse]:
        """Yield the updates of one connection to the event stream."""
        path = f"/api/campaigns/{campaign}/events"
        headers = {"Last-Event-ID": str(after)} if after else {}
        with connect_sse(self._connection.http, "GET", path, headers=headers, timeout=SILENT_S) as source:
            if source.response.is_error:
                source.response.read()
                raise refusal(source.response)
            yield from map(_update, source.iter_sse())


def _update(event: ServerSentEvent) -> EventResponse | CampaignResponse:
    kind = CampaignResponse if event.event == "progress" else EventResponse
    return kind.model_validate_json(event.data)
