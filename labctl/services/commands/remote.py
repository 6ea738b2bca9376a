"""The acts, asked of a running service over HTTP."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any
from urllib.parse import quote

import httpx

from labctl.config import KEY_VARIABLE, key, os_user
from labctl.errors import Conflict, LabctlError, NotCertified, StoreError
from labctl.services.planning.loading import own_text
from labctl.services.recordings.transfer import FILE_NAMES
from labctl.services.schemas.admin import BackupNote, KeyRequest, KeyResponse, NewKeyResponse
from labctl.services.schemas.base import Request
from labctl.services.schemas.benches import BenchStatus, ClearRequest
from labctl.services.schemas.calibrations import (
    CertificationResponse,
    CertifyRequest,
    FitRequest,
    FitResponse,
    ImproveRequest,
)
from labctl.services.schemas.campaigns import (
    CampaignRequest,
    CampaignResponse,
    ConfirmRequest,
    ReasonRequest,
    ResumeRequest,
    StartRequest,
)
from labctl.services.schemas.recordings import ImportResponse
from labctl.services.schemas.schedule import ScheduledResponse

TIMEOUT_S = 300.0
#: By which a command without a key says who runs it.
USER_HEADER = "Labctl-User"


class ServiceRefused(LabctlError):
    """The service answered, and said no; the text is its own."""


class HttpCommands:
    """Every act as a request to a service."""

    def __init__(self, url: str) -> None:
        shown = key()
        # without a key, the name only says who claims to ask; a service that wants a key does not read it
        identity = {"Authorization": f"Bearer {shown}"} if shown else {USER_HEADER: quote(os_user())}
        # whoever holds the database is near: a proxy is neither asked nor told a key
        self._client = httpx.Client(base_url=url, timeout=TIMEOUT_S, headers=identity, trust_env=False)

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
        body = response.json() if response.content else {}
        if response.is_error:
            hint = f" (the command line sends the key in ${KEY_VARIABLE})" if response.status_code == 401 else ""
            refused = ServiceRefused(body.get("detail", response.text) + hint)
            refused.exit_status = NotCertified.exit_status if body.get("type", "").endswith(NotCertified.slug) else 2
            raise refused
        return body

    def import_recording(self, folder: Path) -> ImportResponse:
        """Send a recording's files."""
        with ExitStack() as opened:
            found = [path for path in sorted(folder.glob("*")) if path.name in FILE_NAMES]
            files = [("files", (path.name, opened.enter_context(path.open("rb")))) for path in found]
            if not files:
                raise ServiceRefused(f"{folder}: no recording there (expected recording.toml and a data file)")
            return ImportResponse.model_validate(self._post("/api/recordings", files=files))

    def fit(self, serial: str, request: FitRequest) -> FitResponse:
        """Ask for a fit."""
        return FitResponse.model_validate(
            self._post(f"/api/units/{quote(serial, safe='')}/calibrations", json=request.model_dump())
        )

    def improve(self, serial: str, request: ImproveRequest) -> FitResponse:
        """Ask for a changed model."""
        version = request.version or self._newest(serial)
        path = f"/api/units/{quote(serial, safe='')}/calibrations/{version}/improve"
        return FitResponse.model_validate(self._post(path, json=request.model_dump(exclude={"version"})))

    def _newest(self, serial: str) -> int:
        rows = self._ask("GET", f"/api/units/{quote(serial, safe='')}/calibrations")
        return int(rows[0]["version"]) if rows else 1

    def certify(self, serial: str, version: int, request: CertifyRequest) -> CertificationResponse:
        """Ask for a certification."""
        return self._certification(serial, version, "certify", request)

    def revoke(self, serial: str, version: int, request: CertifyRequest) -> CertificationResponse:
        """Ask for a revocation."""
        return self._certification(serial, version, "revoke", request)

    def _certification(self, serial: str, version: int, act: str, request: CertifyRequest) -> CertificationResponse:
        path = f"/api/units/{quote(serial, safe='')}/calibrations/{version}/{act}"
        return CertificationResponse.model_validate(self._post(path, json=request.model_dump()))

    def start_campaign(self, request: StartRequest) -> CampaignResponse:
        """Ask for a campaign on the service's bench."""
        self._refuse_options(("--bench", request.bench), ("--speed", request.speed), ("--seed", request.seed))
        recipe = own_text(request.recipe)
        return CampaignResponse.model_validate(
            self._post("/api/campaigns", json={"recipe": recipe, "clip": request.clip})
        )

    def _refuse_options(self, *options: tuple[str, object]) -> None:
        for option, given in options:
            if given is not None:
                raise Conflict(
                    f"{option} {given}: the service at {self._client.base_url} holds this database and runs campaigns "
                    "on its own bench at its own pace; leave the option out, stop it, or name another --database"
                )

    def _campaign(self, campaign: int, act: str, request: Request) -> CampaignResponse:
        return CampaignResponse.model_validate(
            self._post(f"/api/campaigns/{campaign}/{act}", json=request.model_dump())
        )

    def pause_campaign(self, campaign: int, request: ReasonRequest) -> CampaignResponse:
        """Ask for a pause."""
        return self._campaign(campaign, "pause", request)

    def resume_campaign(self, campaign: int, request: ResumeRequest) -> CampaignResponse:
        """Ask that a campaign go on."""
        return self._campaign(campaign, "resume", request)

    def confirm(self, campaign: int, request: ConfirmRequest) -> CampaignResponse:
        """Answer a question."""
        return self._campaign(campaign, "confirm", request)

    def clear_bench(self, bench: str, request: ClearRequest) -> BenchStatus:
        """Say that a bench was looked at."""
        return BenchStatus.model_validate(
            self._post(f"/api/benches/{quote(bench, safe='')}/clear", json=request.model_dump())
        )

    def campaign(self, campaign: int) -> CampaignResponse:
        """Return a campaign as the service sees it now."""
        return CampaignResponse.model_validate(self._ask("GET", f"/api/campaigns/{campaign}"))

    def abort_campaign(self, campaign: int, reason: str) -> CampaignResponse:
        """Ask for the end of a campaign."""
        return CampaignResponse.model_validate(self._post(f"/api/campaigns/{campaign}/abort", json={"reason": reason}))

    def create_key(self, request: KeyRequest) -> NewKeyResponse:
        """Ask for a new key."""
        return NewKeyResponse.model_validate(self._post("/api/keys", json=request.model_dump(mode="json")))

    def revoke_key(self, name: str, reason: str) -> KeyResponse:
        """Ask for a key's end."""
        path = f"/api/keys/{quote(name, safe='')}/revoke"
        return KeyResponse.model_validate(self._post(path, json={"reason": reason}))

    def note_backup(self, note: BackupNote) -> None:
        """Ask for a row in the audit trail."""
        self._post("/api/backups", json=note.model_dump())

    def schedule_campaign(self, request: CampaignRequest, bench: str | None = None) -> ScheduledResponse:
        """Ask for a campaign on the service's bench, later."""
        self._refuse_options(("--bench", bench))
        return ScheduledResponse.model_validate(
            self._post("/api/campaigns", json=request.model_dump(exclude_unset=True))
        )

    def cancel_start(self, start: int) -> ScheduledResponse:
        """Ask for an entry to be taken out of the schedule."""
        return ScheduledResponse.model_validate(self._ask("DELETE", f"/api/schedule/{start}"))
