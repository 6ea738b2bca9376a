"""The acts, asked of a running service over HTTP."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx

from labctl.errors import Conflict, LabctlError, NotCertified, StoreError
from labctl.services.acts import CampaignRequest, CertifyRequest, FitRequest, ImproveRequest
from labctl.services.answers import CampaignAnswer, Certified, FitAnswer, Imported, ScheduledAnswer
from labctl.services.planning import own_text
from labctl.services.recordings import FILE_NAMES
from labctl.services.running import StartRequest

TIMEOUT_S = 300.0


class ServiceRefused(LabctlError):
    """The service answered, and said no; the text is its own."""


class RemoteActs:
    """Every act as a request to a service."""

    def __init__(self, url: str) -> None:
        self._client = httpx.Client(base_url=url, timeout=TIMEOUT_S)

    def _post(self, path: str, **content: Any) -> Any:
        return self._ask("POST", path, **content)

    def _ask(self, method: str, path: str, **content: Any) -> Any:
        try:
            response = self._client.request(method, path, **content)
        except httpx.HTTPError as error:
            raise StoreError(
                f"the service at {self._client.base_url} holds the database but does not answer ({error}); "
                "look at it, or stop it"
            ) from error
        body = response.json()
        if response.is_error:
            refused = ServiceRefused(body.get("detail", response.text))
            refused.exit_status = NotCertified.exit_status if body.get("type", "").endswith(NotCertified.slug) else 2
            raise refused
        return body

    def import_recording(self, folder: Path) -> Imported:
        """Send a recording's files."""
        with ExitStack() as opened:
            found = [path for path in sorted(folder.glob("*")) if path.name in FILE_NAMES]
            files = [("files", (path.name, opened.enter_context(path.open("rb")))) for path in found]
            if not files:
                raise ServiceRefused(f"{folder}: no recording there (expected recording.toml and a data file)")
            return Imported.model_validate(self._post("/api/recordings", files=files))

    def fit(self, serial: str, request: FitRequest) -> FitAnswer:
        """Ask for a fit."""
        return FitAnswer.model_validate(self._post(f"/api/units/{serial}/calibrations", json=request.model_dump()))

    def improve(self, serial: str, request: ImproveRequest) -> FitAnswer:
        """Ask for a changed model."""
        version = request.version or self._newest(serial)
        path = f"/api/units/{serial}/calibrations/{version}/improve"
        return FitAnswer.model_validate(self._post(path, json=request.model_dump(exclude={"version"})))

    def _newest(self, serial: str) -> int:
        rows = self._client.get(f"/api/units/{serial}/calibrations").json()
        return int(rows[0]["version"]) if isinstance(rows, list) and rows else 1

    def certify(self, serial: str, version: int, request: CertifyRequest) -> Certified:
        """Ask for a certification."""
        return self._certification(serial, version, "certify", request)

    def revoke(self, serial: str, version: int, request: CertifyRequest) -> Certified:
        """Ask for a revocation."""
        return self._certification(serial, version, "revoke", request)

    def _certification(self, serial: str, version: int, act: str, request: CertifyRequest) -> Certified:
        path = f"/api/units/{serial}/calibrations/{version}/{act}"
        return Certified.model_validate(self._post(path, json=request.model_dump()))

    def start_campaign(self, request: StartRequest) -> CampaignAnswer:
        """Ask for a campaign on the service's bench."""
        self._refuse_options(("--bench", request.bench), ("--speed", request.speed), ("--seed", request.seed))
        recipe = own_text(request.recipe)
        return CampaignAnswer.model_validate(
            self._post("/api/campaigns", json={"recipe": recipe, "clip": request.clip})
        )

    def _refuse_options(self, *options: tuple[str, object]) -> None:
        for option, given in options:
            if given is not None:
                raise Conflict(
                    f"{option} {given}: the service at {self._client.base_url} holds this database and runs campaigns "
                    "on its own bench at its own pace; leave the option out, stop it, or name another --database"
                )

    def abort_campaign(self, campaign: int, reason: str) -> CampaignAnswer:
        """Ask for the end of a campaign."""
        return CampaignAnswer.model_validate(self._post(f"/api/campaigns/{campaign}/abort", json={"reason": reason}))

    def schedule_campaign(self, request: CampaignRequest, bench: str | None = None) -> ScheduledAnswer:
        """Ask for a campaign on the service's bench, later."""
        self._refuse_options(("--bench", bench))
        return ScheduledAnswer.model_validate(self._post("/api/campaigns", json=request.model_dump(exclude_unset=True)))

    def cancel_start(self, start: int) -> ScheduledAnswer:
        """Ask for an entry to be taken out of the schedule."""
        return ScheduledAnswer.model_validate(self._ask("DELETE", f"/api/schedule/{start}"))
