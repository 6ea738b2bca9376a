"""The campaigns that a service runs, each with a wire log in a folder where the service has one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

from instruments.bench_config import BenchFile
from instruments.clock import Clock, WallClock
from labctl.answers.campaigns import CampaignRequest, CampaignResponse, ResumeRequest
from labctl.answers.wire_logs import RecordedSession
from labctl.errors import BadInput
from labctl.log import get_logger
from labctl.services.benches.wire_log import SessionLog, recording
from labctl.services.campaigns.bench_lending import BenchLending
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import Prepared, prepare
from labctl.services.campaigns.readings_digest import readings_digest
from labctl.services.campaigns.recorded_operator import RecordedOperator
from labctl.services.campaigns.resume import prepare_resume
from labctl.services.planning.loading import own_text
from labctl.store import Store
from procedures.contracts.control import Control
from procedures.monitoring.progress import Progress

log = get_logger()

SUFFIX = ".jsonl.gz"


class RecordedCampaigns:
    """Prepares and runs the campaigns of one bench, one at a time. Without a folder nothing is recorded.

    The log of a campaign begins before its bench is opened. It ends when the campaign has ended, so that a stop by
    another thread, through the same drivers, is in it.
    """

    def __init__(self, store: Store, folder: Path | None) -> None:
        """Make the folder; raises BadInput where that cannot be done."""
        self._store, self._folder = store, folder
        self._open = ExitStack()
        self._log: SessionLog | None = None
        if folder is not None:
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise BadInput(
                    f"--wire-logs {folder}: the folder cannot be made ({error.strerror}); name one that can be written"
                ) from error

    def prepare(self, request: CampaignRequest, bench: BenchFile, clock: Clock, clear: str) -> Prepared:
        """Plan a campaign and write it down; `clear`: what a person has confirmed. Raises as `prepare` does."""
        session = RecordedSession(kind="campaign", recipe=own_text(request.recipe), clip=request.clip, fit=request.fit)
        with self._beginning(bench, clock, session) as preparation:
            prepared = prepare(
                self._store, request.recipe, bench, clock, clip=request.clip, fit=request.fit, bench_clear=clear,
                wire=None if preparation is None else preparation.wire,
            )  # fmt: skip
        self._name(f"campaign-{prepared.id}")
        return prepared

    def resume(self, campaign: int, bench: BenchFile, clock: Clock, request: ResumeRequest) -> Prepared:
        """Mark a campaign as resumed. Raises as `prepare_resume` does."""
        session = RecordedSession(kind="campaign resume", campaign=campaign)
        with self._beginning(bench, clock, session) as preparation:
            wire = None if preparation is None else preparation.wire
            prepared = prepare_resume(self._store, campaign, bench, lambda _: clock, request, wire=wire)
        self._name(f"campaign-{campaign}-resumed")
        return prepared

    def run(
        self, prepared: Prepared, control: Control, observe: Callable[[Progress], None], lending: BenchLending
    ) -> CampaignResponse:
        """Run the campaign that was prepared last to its end. Raises as `run` does."""
        session_log, self._log = self._log, None
        with self._open.pop_all():
            if session_log is None:
                return run(self._store, prepared, control, observe, lending)
            if not prepared.operator.at_once:
                prepared = replace(prepared, operator=RecordedOperator(prepared.operator, session_log.wire.note))
            answer = run(self._store, prepared, control, observe, lending)
            session_log.result.state = answer.state.value
            session_log.result.readings = readings_digest(self._store, answer.id)
            return answer

    @contextmanager
    def _beginning(self, bench: BenchFile, clock: Clock, session: RecordedSession) -> Iterator[SessionLog | None]:
        """Yield a log that has begun, which stays open for `run` where the block ends without an error."""
        path = None if self._folder is None else self._folder / f"begun-{WallClock().utc():%Y%m%dT%H%M%S.%fZ}{SUFFIX}"
        self._open.close()  # of a campaign that was prepared and did not begin
        with ExitStack() as opened:
            session_log = opened.enter_context(recording(path, bench, clock, session))
            yield session_log
            self._open, self._log = opened.pop_all(), session_log

    def _name(self, name: str) -> None:
        """Name the log of a campaign whose number is known; a log that is there keeps its name."""
        if self._log is None or self._folder is None:
            return
        path, n = self._folder / f"{name}{SUFFIX}", 1
        while path.exists():
            n += 1
            path = self._folder / f"{name}-{n}{SUFFIX}"
        try:
            self._log.wire.rename(path)
        except OSError as error:  # the campaign is written down, and the log goes on under its first name
            log.warning("wire_log.not_named", file=str(path), reason=error.strerror)
