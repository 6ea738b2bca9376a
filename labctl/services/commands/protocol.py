"""The acts that change the database. One process at a time may write, so an act is done here or asked of who holds it.

`open_commands` gives the one that fits: the services of this process, or the running service that holds the database.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from labctl.services.schemas.admin import BackupNote
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
)
from labctl.services.schemas.recordings import ImportResponse
from labctl.services.schemas.schedule import ScheduledResponse

if TYPE_CHECKING:
    from labctl.services.schemas.admin import KeyRequest, KeyResponse, NewKeyResponse


class Commands(Protocol):
    """Every act that changes the database."""

    def import_recording(self, folder: Path) -> ImportResponse:
        """Take in a recording from a folder in the interchange format; all of it or nothing."""
        ...

    def fit(self, serial: str, request: FitRequest) -> FitResponse:
        """Fit a model and keep it as the unit's next version."""
        ...

    def improve(self, serial: str, request: ImproveRequest) -> FitResponse:
        """Change a version's effects and keep the fit as the unit's next version."""
        ...

    def certify(self, serial: str, version: int, request: CertifyRequest) -> CertificationResponse:
        """Make a version the unit's current one."""
        ...

    def revoke(self, serial: str, version: int, request: CertifyRequest) -> CertificationResponse:
        """Take a version out of force."""
        ...

    def abort_campaign(self, campaign: int, reason: str) -> CampaignResponse:
        """End a campaign now, in the safe state."""
        ...

    def create_key(self, request: KeyRequest) -> NewKeyResponse:
        """Make an API key; the answer is the only place where it is shown."""
        ...

    def revoke_key(self, name: str, reason: str) -> KeyResponse:
        """Take a key's power away."""
        ...

    def note_backup(self, note: BackupNote) -> None:
        """Write down that a backup was made."""
        ...

    def pause_campaign(self, campaign: int, request: ReasonRequest) -> CampaignResponse:
        """Ask a running campaign to hold after the present data set."""
        ...

    def resume_campaign(self, campaign: int, request: ResumeRequest) -> CampaignResponse:
        """Let a paused campaign go on, or take up one that was interrupted."""
        ...

    def confirm(self, campaign: int, request: ConfirmRequest) -> CampaignResponse:
        """Answer the question that a campaign has put. Raises StalePrompt for another one."""
        ...

    def clear_bench(self, bench: str, request: ClearRequest) -> BenchStatus:
        """Take in that a person has looked at a bench that was not confirmed safe."""
        ...

    def schedule_campaign(self, request: CampaignRequest, bench: str | None = None) -> ScheduledResponse:
        """Enter a campaign into the schedule of a bench; a recipe in a file is given by its own text."""
        ...

    def cancel_start(self, start: int) -> ScheduledResponse:
        """Take an entry out of the schedule."""
        ...
