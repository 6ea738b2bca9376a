"""Whatever is done to a campaign in whatever order: its states follow the table, its plan is done once and whole."""

from __future__ import annotations

from collections import Counter
from typing import Any

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from instruments.errors import NoReply, RequestRejected
from procedures.contracts.campaign_state import NEXT, CampaignState
from procedures.contracts.control import Control
from procedures.execution.resume import Restart
from tests.helpers.engine_rig import Rig
from tests.helpers.recording_journal import RecordingJournal


class Killed(BaseException):
    """The process is gone: not even the safe state is reached."""


ENTRIES = ("state", "step_started", "step_ended", "dataset_opened", "readings", "dataset_closed", "environment")
instants = st.integers(0, 60)


class Campaign(RuleBasedStateMachine):
    """One campaign on the fake bench, run in legs: each leg ends as it is drawn, and the next resumes it."""

    def __init__(self) -> None:
        super().__init__()
        self.rig: Any = Rig(("imu", "fog"))
        self.finished: set[int] = set()
        self.complete: Counter[int] = Counter()
        self.legs = 0
        self.state = CampaignState.PLANNED
        self.killed = False
        self.reported = [CampaignState.PLANNED]

    def leg(self, **commands: Any) -> None:
        """Run from where the campaign stands; `acts` are done at the n-th entry of the journal, counted from here."""
        rig = self.rig
        rig.trace.clear()
        rig.journal = RecordingJournal(rig.trace)
        rig.control = Control()
        for device in (rig.table, rig.chamber, *rig.gyros.values()):
            device.faults.clear()
        seen = [0]

        def hook(what: str, detail: Any) -> None:
            if what == "state":
                self.reported.append(detail)
            if what == "step_ended":
                index, result = rig.journal.steps[-1][1:]
                self.finished |= {index} if result.outcome in {"done", "skipped"} else set()
            if what == "dataset_closed" and rig.journal.closed[-1][1] == "complete":
                self.complete[rig.journal.headers[-1].step.dataset] += 1
                self.finished.add(rig.journal.steps[-1][1])  # as the database does: the data set is there
            seen[0] += 1
            for at, act in commands.get("at", ()):
                if seen[0] == at + 1:
                    act()

        rig.journal.hooks.append(hook)
        engine = rig.make()
        left = [index for index in range(len(engine.plan.steps)) if index not in self.finished]
        start_at = left[0] if left else len(engine.plan.steps)
        restart = Restart(gap_s=float(self.legs)) if self.legs else None
        self.legs += 1
        self.killed = False
        try:
            self.state = engine.run(start_at, restart).state
        except Killed:
            self.killed = True
            self.state = CampaignState.RUNNING

    def kill(self) -> None:
        def dead() -> None:
            raise Killed

        for device in (self.rig.table, self.rig.chamber, *self.rig.gyros.values()):
            for method in ("stop", "make_safe", "read", "read_latest", "spin", "settle", "start", "home", "identify"):
                device.faults[method] = dead
        self.rig.journal.hooks.insert(0, lambda *_: dead())
        raise Killed

    unfinished = precondition(lambda self: self.state is not CampaignState.DONE)

    @unfinished
    @rule(at=instants)
    def is_killed(self, at: int) -> None:
        self.leg(at=[(at, self.kill)])

    @unfinished
    @rule(at=instants)
    def is_aborted(self, at: int) -> None:
        self.leg(at=[(at, lambda: self.rig.control.abort("enough"))])

    @unfinished
    @rule(at=instants)
    def has_to_let_the_bench_go(self, at: int) -> None:
        self.leg(at=[(at, lambda: self.rig.control.interrupt("the lease is another's"))])
        assert self.state in {CampaignState.INTERRUPTED, CampaignState.DONE}  # or it was over before

    @unfinished
    @rule(at=instants, last=st.integers(1, 40))
    def is_paused_and_goes_on(self, at: int, last: int) -> None:
        self.leg(at=[(at, self.rig_pause), (at + last, self.rig_goes_on)])

    def rig_goes_on(self) -> None:
        self.rig.control.resume()

    def rig_pause(self) -> None:
        self.rig.control.pause()
        left = [5]

        def goes_on(what: str, _detail: Any) -> None:  # a pause ends, also where nothing else is written down
            left[0] -= what == "environment"
            if left[0] == 0:
                self.rig.control.resume()

        self.rig.journal.hooks.append(goes_on)

    @unfinished
    @rule(at=instants, device=st.sampled_from(["table", "chamber", "imu", "fog"]), times=st.integers(1, 5))
    def meets_a_fault(self, at: int, device: str, times: int) -> None:
        def fail() -> None:
            broken = self.rig.gyros.get(device) or getattr(self.rig, device)
            method = {"table": "spin", "chamber": "read"}.get(device, "read")
            error = RequestRejected if device == "table" else NoReply
            broken.fail(method, error(device, "broken"), times=times)

        self.leg(at=[(at, fail)])

    @unfinished
    @rule()
    def is_left_alone(self) -> None:
        self.leg()

    @precondition(lambda self: self.state is CampaignState.DONE)
    @rule()
    def is_over(self) -> None:
        assert self.finished == set(range(len(self.rig.plan().steps)))

    @invariant()
    def states_follow_the_table(self) -> None:
        for before, after in zip(self.reported, self.reported[1:], strict=False):
            assert after in NEXT[before], f"{before} -> {after}"

    @invariant()
    def the_bench_is_safe_unless_the_process_was_killed(self) -> None:
        if self.legs and not self.killed:
            self.rig.assert_safe()

    @invariant()
    def no_data_set_is_taken_twice(self) -> None:
        assert all(count == 1 for count in self.complete.values())
        if self.state is CampaignState.DONE:
            assert set(self.complete) == {1, 2, 3, 4}


Campaign.TestCase.settings = settings(
    max_examples=40, stateful_step_count=8, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck)
)
TestCampaign = Campaign.TestCase
