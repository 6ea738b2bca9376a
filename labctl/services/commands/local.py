"""Which store, and who acts: this process, or the running service that holds the database."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from instruments.clock import Clock, SystemClock
from labctl.config import default_database
from labctl.errors import Conflict
from labctl.services.admin import api_keys
from labctl.services.calibrations import certification, fitting, revision
from labctl.services.campaigns.bench_status import bench_status
from labctl.services.campaigns.status import campaign_status, outlives_its_process
from labctl.services.commands.protocol import Commands
from labctl.services.planning.loading import bench_for, load_bench, load_recipe
from labctl.services.recordings import examples, transfer
from labctl.services.schedule import queue
from labctl.services.schemas.admin import BackupNote, KeyRequest, KeyResponse, NewKeyResponse
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
from labctl.services.schemas.recordings import (
    ExampleRequest,
    ImportResponse,
    SimulatedRecordingResponse,
    SimulatedRequest,
)
from labctl.services.schemas.schedule import ScheduledResponse
from labctl.store import Store, holder_of, open_store

#: What a campaign is called while its bench may move or be hot; one that was interrupted had its safe state.
UNDER_WAY = frozenset({"running", "paused", "waiting"})


class LocalCommands:
    """The acts, done by this process."""

    def __init__(self, store: Store, clock: Clock) -> None:
        self._store = store
        self._clock = clock

    def import_recording(self, folder: Path) -> ImportResponse:
        """Take in a recording from a folder."""
        return transfer.import_folder(self._store, folder, self._clock.utc())

    def simulate_recording(self, request: SimulatedRequest) -> SimulatedRecordingResponse:
        """Make a recording in simulation and take it in."""
        return examples.add_simulated(self._store, request, self._clock.utc())

    def import_example(self, request: ExampleRequest) -> ImportResponse:
        """Take in a recording that comes with labctl."""
        return self.import_recording(examples.example(request.name))

    def fit(self, serial: str, request: FitRequest) -> FitResponse:
        """Fit a model and keep it as the unit's next version."""
        return fitting.fit_unit(self._store, serial, request, self._clock.utc())

    def improve(self, serial: str, request: ImproveRequest) -> FitResponse:
        """Change a version's effects and keep the fit as the unit's next version."""
        return revision.improve_unit(self._store, serial, request, self._clock.utc())

    def certify(self, serial: str, version: int, request: CertifyRequest) -> CertificationResponse:
        """Make a version the unit's current one."""
        return certification.certify(self._store, serial, version, "certify", request, self._clock.utc())

    def revoke(self, serial: str, version: int, request: CertifyRequest) -> CertificationResponse:
        """Take a version out of force."""
        return certification.certify(self._store, serial, version, "revoke", request, self._clock.utc())

    def abort_campaign(self, campaign: int, reason: str) -> CampaignResponse:
        """Close a campaign that no process runs any more; one that runs here would hold the database."""
        answer = campaign_status(self._store, campaign)
        if answer.state in {"done", "aborted", "failed"}:
            raise Conflict(f"campaign {campaign} is over already: {answer.state}")
        self._note_campaign("abort", campaign, reason)
        row, at = self._store.campaigns.get(campaign), self._clock.utc()
        said = f"left unfinished; {reason}"
        if row.state in UNDER_WAY and outlives_its_process(row):
            text = f"the process that ran campaign {campaign} ended before it could make the bench safe"
            self._store.benches.mark(row.bench_name, text, at)
            said += f". Nobody has made bench {row.bench_name} safe: look at it, then `labctl bench clear`"
        self._store.campaigns.close_unfinished(campaign, said, at, "aborted")
        return campaign_status(self._store, campaign)

    def _note_campaign(self, act: str, campaign: int, reason: str) -> None:
        """Write down what a person did to a campaign, before it shows."""
        self._store.audit.record(self._clock.utc(), f"campaign {act}", f"campaign {campaign}", {"reason": reason})

    def create_key(self, request: KeyRequest) -> NewKeyResponse:
        """Make an API key."""
        return api_keys.create_key(self._store, request, self._clock.utc())

    def revoke_key(self, name: str, reason: str) -> KeyResponse:
        """Take a key's power away."""
        return api_keys.revoke_key(self._store, name, reason, self._clock.utc())

    def note_backup(self, note: BackupNote) -> None:
        """Write down that a backup was made."""
        detail = {"bytes": note.bytes, "sha256": note.sha256}
        self._store.audit.record(self._clock.utc(), "backup", note.file, detail)

    def pause_campaign(self, campaign: int, request: ReasonRequest) -> CampaignResponse:
        """Raise Conflict: what this process could pause would hold the database."""
        raise self._not_here(campaign, f"pause it ({request.reason})")

    def resume_campaign(self, campaign: int, request: ResumeRequest) -> CampaignResponse:
        """Raise Conflict: a campaign is taken up by a process that stays."""
        raise self._not_here(campaign, f"let it go on ({request.by})")

    def confirm(self, campaign: int, request: ConfirmRequest) -> CampaignResponse:
        """Raise Conflict: nobody here has put a question."""
        raise self._not_here(campaign, f"answer question {request.prompt}")

    def _not_here(self, campaign: int, what: str) -> Conflict:
        state = self._store.campaigns.get(campaign).state
        return Conflict(f"campaign {campaign} is {state} and no process runs it; there is nobody to {what}")

    def clear_bench(self, bench: str, request: ClearRequest) -> BenchStatus:
        """Take in that a person has looked at a bench."""
        return bench_status(self._store.benches.clear(bench, request.by, request.reason, self._clock.utc()))

    def schedule_campaign(self, request: CampaignRequest, bench: str | None = None) -> ScheduledResponse:
        """Enter a campaign into the schedule of a bench; a service that holds this bench and database begins it."""
        file = load_bench(bench or bench_for(load_recipe(request.recipe)))
        answer = queue.add_start(self._store, request, file, self._clock.utc())
        said = "; ".join(filter(None, (queue.NOBODY.format(bench=file.name), answer.note)))
        return answer.model_copy(update={"note": said})

    def cancel_start(self, start: int) -> ScheduledResponse:
        """Take an entry out of the schedule."""
        return queue.cancel_start(self._store, start, self._clock.utc())


def service_url(database: str | None) -> str | None:
    """Return the address of the service that holds the database; None when no service does."""
    holder = holder_of(database or default_database())
    return holder.url if holder is not None else None


@contextmanager
def open_commands(database: str | None) -> Iterator[Commands]:
    """Give what acts on the database: this process, or the service that holds it."""
    location = database or default_database()
    if url := service_url(location):
        from labctl.services.commands.remote import HttpCommands  # noqa: PLC0415  an HTTP client only where one is needed

        yield HttpCommands(url)
        return
    with open_store(location, write=True) as store:
        yield LocalCommands(store, SystemClock())
