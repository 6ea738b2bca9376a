"""A diagnosis in the foreground of this process: its campaigns run here, each until it is over."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Protocol

from instruments.clock import SystemClock
from labctl.acting_user import actor
from labctl.answers.campaigns import BENCH_CHECKS, ResumeRequest, StartRequest
from labctl.answers.criticism import CriticismResponse
from labctl.answers.diagnosis import DiagnosisRequest, DiagnosisResponse, DiagnosisRound
from labctl.config import default_database
from labctl.errors import NotFound, Stopped
from labctl.services.campaigns.execution import AskClear, Attend, Observe, run_here
from labctl.services.campaigns.resumability import retries_exhausted
from labctl.services.campaigns.resume import resume_here
from labctl.services.diagnosis import begin
from labctl.services.diagnosis.advance import DiagnosisRunner, ExperimentStart
from labctl.services.diagnosis.answer import diagnosis_answer
from labctl.services.diagnosis.begin import Reply
from labctl.services.diagnosis.experiment_bench import simulated_day
from labctl.services.diagnosis.in_service import criticise_together
from labctl.services.planning.loading import load_bench
from labctl.store import CampaignRow, Store, open_store
from procedures.contracts.campaign_state import ENDED, CampaignState


class Terminal(Protocol):
    """The terminal of a campaign in the foreground."""

    @property
    def observe(self) -> Observe | None: ...
    @property
    def attend(self) -> Attend | None: ...
    @property
    def say(self) -> Callable[[str], None] | None: ...
    @property
    def ask_clear(self) -> AskClear | None: ...


class ForegroundLaboratory:
    """Criticises and measures in this process."""

    def __init__(self, database: str, open_terminal: Callable[[], AbstractContextManager[Terminal]]) -> None:
        self._database, self._open_terminal = database, open_terminal

    def criticise(self, serial: str, version: int, recordings: list[int]) -> CriticismResponse:
        """Judge a version by several recordings together."""
        with open_store(self._database, write=False) as store:
            return criticise_together(store, serial, version, tuple(recordings))

    def start(self, experiment: ExperimentStart) -> None:
        """Run a campaign to its end. One that begins later is left to the service that begins it."""
        if experiment.begins_at is not None:
            return
        with open_store(self._database, write=False) as store:
            day = simulated_day(store, experiment.bench)
        checks = list(BENCH_CHECKS) if experiment.confirmed_by else []
        request = StartRequest(
            recipe=experiment.recipe, fit=False, simulated_start=day, confirmed_by=experiment.confirmed_by,
            checks=checks,
        )  # fmt: skip
        with self._open_terminal() as terminal:
            run_here(
                self._database, request, terminal.observe, terminal.attend, terminal.say, terminal.ask_clear,
                bench=experiment.bench,
            )  # fmt: skip

    def go_on(self, campaign: CampaignRow, *, resumed: bool) -> bool:
        """Resume a campaign that an earlier process has left, and run it to its end; an aborted one where `resumed`."""
        if campaign.state in ENDED and not (resumed and campaign.state is CampaignState.ABORTED):
            return True
        with open_store(self._database, write=False) as store:
            why_not = retries_exhausted(store.resume_points.of_campaign(campaign.id))
        if why_not is not None:
            with open_store(self._database, write=True) as store:
                store.campaigns.close_unfinished(campaign.id, f"not resumed: {why_not}", SystemClock().utc())
            return True
        request = ResumeRequest(by=actor().name)
        with self._open_terminal() as terminal:
            resume_here(self._database, campaign.id, None, None, request, terminal.observe, terminal.attend)
        return True


class ForegroundDiagnosis:
    """Runs a diagnosis at a terminal until it ends, or waits for a person who does not answer."""

    def __init__(
        self,
        database: str | None,
        open_terminal: Callable[[], AbstractContextManager[Terminal]],
        ask: Callable[[DiagnosisResponse, DiagnosisRound], Reply | None],
        report: Callable[[DiagnosisResponse], None],
    ) -> None:
        """`ask` puts an experiment to the person at the terminal; `report` is called after every move."""
        self._database, self._ask, self._report = database or default_database(), ask, report
        self._laboratory = ForegroundLaboratory(self._database, open_terminal)
        self._runner = DiagnosisRunner(self._open, self._laboratory, SystemClock().utc)

    def _open(self) -> AbstractContextManager[Store]:
        return open_store(self._database, write=True)

    def run(self, diagnosis: int) -> DiagnosisResponse:
        """Go on until the diagnosis ends. Raises Stopped after a Ctrl-C: the same command continues it."""
        try:
            answer = self._continued(diagnosis)
            while not answer.ended:
                self._report(answer)
                if answer.state == "awaiting_confirmation":
                    if not self._answered(answer):
                        return answer
                elif not self._runner.advance(diagnosis):
                    return self._answer(diagnosis)
                answer = self._answer(diagnosis)
        except (Stopped, KeyboardInterrupt) as stopped:
            raise Stopped(self._note_stop(diagnosis, str(stopped))) from stopped
        self._report(answer)
        return answer

    def _answer(self, diagnosis: int) -> DiagnosisResponse:
        with open_store(self._database, write=False) as store:
            return diagnosis_answer(store, diagnosis)

    def _continued(self, diagnosis: int) -> DiagnosisResponse:
        """Let a diagnosis that was stopped go on. Its aborted campaign is resumed before that is written down."""
        answer = self._answer(diagnosis)
        if answer.state not in {"stopped", "failed"}:
            return answer
        with open_store(self._database, write=False) as store:
            campaign = begin.open_campaign(store, diagnosis)
        if campaign is not None:
            self._laboratory.go_on(campaign, resumed=True)
        with self._open() as store:
            return begin.resume(store, diagnosis, f"continued by {actor().name}", SystemClock().utc())

    def _answered(self, answer: DiagnosisResponse) -> bool:
        """Ask the person at the terminal; returns whether there was an answer."""
        last = answer.rounds[-1]
        if (reply := self._ask(answer, last)) is None:
            return False
        request = begin.confirmation_of(last.number, reply)
        with self._open() as store:
            begin.answer_experiment(store, answer.id, request, SystemClock().utc())
        return True

    def _note_stop(self, diagnosis: int, text: str) -> str:
        """Write down that the diagnosis was stopped here; returns what to say."""
        answer = self._answer(diagnosis)
        if answer.state in begin.STOPPABLE:
            with self._open() as store:
                begin.stop(store, diagnosis, f"stopped by {actor().name} at the terminal", SystemClock().utc())
        before = f"{text.partition('; `labctl campaign resume')[0]}; " if text else ""
        return f"{before}diagnosis {diagnosis} was stopped; `labctl diagnose {answer.serial}` continues it"


def no_questions(_: DiagnosisResponse, __: DiagnosisRound) -> Reply | None:
    """Answer no question: there is no person at the terminal."""
    return None


def begin_here(
    database: str | None, serial: str, request: DiagnosisRequest, bench: str | None
) -> tuple[DiagnosisResponse, bool]:
    """Return the diagnosis of a unit that has not ended, or a new one, and whether it is new.

    `bench` is a file or a shipped name; default: the bench of the unit's last campaign. Raises LabctlError.
    """
    named = None if bench is None else load_bench(bench)
    with open_store(database or default_database(), write=True) as store:
        if (row := store.diagnoses.open_of_unit(serial)) is not None:
            return diagnosis_answer(store, row.id), False
        return begin.begin(store, serial, request, named, SystemClock().utc()), True


def end_here(database: str | None, serial: str) -> DiagnosisResponse:
    """End the diagnosis of a unit for good. Raises NotFound where none is open."""
    with open_store(database or default_database(), write=True) as store:
        if (row := store.diagnoses.open_of_unit(serial)) is None:
            raise NotFound(f"unit {serial!r} has no open diagnosis; `labctl diagnose {serial}` starts one")
        return begin.end(store, row.id, f"ended by {actor().name}", SystemClock().utc())
