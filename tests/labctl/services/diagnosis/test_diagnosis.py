"""A diagnosis from its start to its end on a simulated bench, over kills between any two writes."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from labctl.answers.calibrations import ImproveRequest
from labctl.answers.campaigns import BENCH_CHECKS, CampaignResponse
from labctl.answers.criticism import CriticismResponse
from labctl.answers.diagnosis import ConfirmExperimentRequest, DiagnosisRequest, DiagnosisResponse
from labctl.errors import BadInput, Conflict, NotEnoughData, StartNotConfirmed, Stopped
from labctl.services.calibrations.revision import improve_unit
from labctl.services.commands.foreground_control import CampaignTerminal, OpenTerminal, no_terminal
from labctl.services.diagnosis import begin
from labctl.services.diagnosis.answer import diagnosis_answer
from labctl.services.diagnosis.foreground import ForegroundDiagnosis, begin_here, no_questions
from labctl.services.planning.loading import load_bench
from labctl.store import Store, open_store
from labctl.store.repositories.campaign_journal import StoreJournal
from labctl.store.repositories.campaigns import Campaigns
from labctl.store.repositories.diagnoses import Diagnoses
from tests.helpers.diagnoses import NOW, UNIT, ScriptedLaboratory, copied, criticism, experiment

#: Beyond the range of the chamber of the bench.
TOO_HOT = experiment("a temperature that the chamber does not reach", 1.0, temperatures_c=[500.0])
FIRST = experiment("at rest at one temperature", 1.0)
SECOND = experiment("the temperatures up and down", 2.0, temperatures_c=[25.0, 26.0], temperature_order="up_down")


def one_after_two(recordings: list[int]) -> CriticismResponse:
    """Propose an experiment that the bench refuses, then two that it can do; then name one cause."""
    if len(recordings) == 3:
        return criticism("missing", "warm_up", recordings=recordings)
    experiments = [TOO_HOT, FIRST, SECOND]
    return criticism("ambiguous", "thermal_lag", "warm_up", experiments=experiments, recordings=recordings)


def one_after_one(recordings: list[int]) -> CriticismResponse:
    """The same with one experiment that the bench can do."""
    return one_after_two(recordings if len(recordings) == 1 else [*recordings, 3])


def diagnosis(
    location: str, script: Callable[[list[int]], CriticismResponse], terminal: OpenTerminal = no_terminal
) -> ForegroundDiagnosis:
    made = ForegroundDiagnosis(location, terminal, no_questions, lambda _: None)
    laboratory = ScriptedLaboratory(location, terminal)
    laboratory.script = script
    made._laboratory = laboratory
    made._runner._laboratory = laboratory
    return made


def run(location: str, script: Callable[[list[int]], CriticismResponse] = one_after_two) -> DiagnosisResponse:
    answer, _ = begin_here(location, UNIT, DiagnosisRequest(hours=24), None)
    return diagnosis(location, script).run(answer.id)


def campaigns(location: str) -> list[str]:
    with open_store(location, write=False) as store:
        return sorted(row.recipe_name for row in store.campaigns.all())


@pytest.mark.slow
def test_it_goes_on_until_one_cause_is_left(location: str) -> None:
    answer = run(location)
    assert (answer.state, answer.outcome, answer.named) == ("done", "one_cause", ["warm_up"])
    assert [each.came for each in answer.rounds] == ["cannot_be_done", "measured", "measured", None]
    assert [each.recordings for each in answer.rounds] == [[1], [1], [1, 2], [1, 2, 3]]
    refused, first, _, last = answer.rounds
    assert "500" in refused.came_text
    assert "it is not proposed again" in refused.came_text
    assert refused.campaign is None
    assert first.came_text.startswith("expected: one cause named alone with a probability of 96 %, in 1.0 h; ")
    assert "verdict then: ambiguous" in first.came_text
    assert answer.spent_hours == pytest.approx(last.spent_hours)
    assert 0 < last.spent_hours < 24
    assert campaigns(location) == ["diagnosis-1-round-2", "diagnosis-1-round-3", "short"]


def test_one_for_later_is_left_to_a_service(location: str) -> None:
    before = campaigns(location)
    begun, _ = begin_here(location, UNIT, DiagnosisRequest(at="2099-01-01T22:00Z"), None)
    answer = diagnosis(location, one_after_two).run(begun.id)
    assert (answer.state, [each.came for each in answer.rounds]) == ("measuring", [None])
    assert campaigns(location) == before


@pytest.mark.slow
def test_its_campaigns_are_on_the_same_units_on_other_days(location: str) -> None:
    run(location)
    with open_store(location, write=False) as store:
        simulations = [row.bench["simulation"] for row in store.campaigns.all()]
    assert [each["hidden"] for each in simulations] == [{"warm_up": 0.05}] * 3
    assert len({each["noise_seed"] for each in simulations}) == 3


@pytest.mark.slow
def test_a_ctrl_c_stops_it_and_the_same_command_continues_its_campaign(location: str) -> None:
    answer, _ = begin_here(location, UNIT, DiagnosisRequest(hours=24), None)

    pressed: list[int] = []

    def press(status: CampaignResponse) -> None:
        if not pressed:
            pressed.append(status.id)
            raise KeyboardInterrupt

    @contextmanager
    def terminal() -> Iterator[CampaignTerminal]:
        yield CampaignTerminal(observe=press)

    with pytest.raises(Stopped, match=f"campaign 2 was stopped; .*; `labctl diagnose {UNIT}` continues it"):
        diagnosis(location, one_after_one, terminal).run(answer.id)
    stopped = diagnosis_of(location)
    assert (stopped.state, stopped.rounds[-1].came) == ("stopped", None)
    assert f"`labctl diagnose {UNIT}` continues it" in stopped.next
    ended = run(location, one_after_one)
    assert (ended.id, ended.outcome) == (answer.id, "one_cause")
    assert campaigns(location) == ["diagnosis-1-round-2", "short"]
    with open_store(location, write=False) as store:
        kinds = [event.message for event in store.campaigns.events(2)]
    assert any("resumed" in each for each in kinds)


class KillAfter:
    """Ends the process, without any clean-up, after the write number `number` of those that a diagnosis makes."""

    def __init__(self, number: int) -> None:
        self.left = number

    def wrap(self, kind: type, method: str) -> None:
        written = getattr(kind, method)

        def write(*args: object, **kwargs: object) -> object:
            result = written(*args, **kwargs)
            self.left -= 1
            if self.left == 0:
                os._exit(9)
            return result

        setattr(kind, method, write)


#: Writes that move a diagnosis or one of its campaigns.
WRITES = (
    (Diagnoses, "begin"), (Diagnoses, "add_round"), (Diagnoses, "note_campaign"), (Diagnoses, "conclude_round"),
    (Campaigns, "create"), (StoreJournal, "campaign_state"),
)  # fmt: skip


def killed_after(number: int, location: str) -> bool:
    """Run a diagnosis in a process of its own that is killed after a write; returns whether it was."""
    child = os.fork()
    if child == 0:
        kill = KillAfter(number)
        try:
            for kind, method in WRITES:
                kill.wrap(kind, method)
            run(location, one_after_one)
            os._exit(0)
        finally:
            os._exit(1)
    _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) in {0, 9}
    return os.waitstatus_to_exitcode(status) == 9


@pytest.mark.slow
def test_a_kill_after_any_write_leads_to_the_same_end(fitted: Path, tmp_path: Path) -> None:
    expected = _comparable(run(copied(fitted, tmp_path / "whole"), one_after_one))
    number = 0
    while True:
        number += 1
        location = copied(fitted, tmp_path / str(number))
        was_killed = killed_after(number, location)
        has_ended = not was_killed or is_done(location)
        answer = diagnosis_of(location) if has_ended else run(location, one_after_one)
        assert _comparable(answer) == expected, f"killed after write {number}"
        assert campaigns(location) == ["diagnosis-1-round-2", "short"]
        if not was_killed:
            break
    assert number > 10  # every write of a campaign and three rounds was followed by a kill


def is_done(location: str) -> bool:
    with open_store(location, write=False) as store:
        return store.diagnoses.get(1).state == "done"


def diagnosis_of(location: str) -> DiagnosisResponse:
    with open_store(location, write=False) as store:
        return diagnosis_answer(store, 1)


def _comparable(answer: DiagnosisResponse) -> list[tuple[object, ...]]:
    rounds = [(each.number, each.recordings, each.verdict, each.came, each.campaign, each.recording)
              for each in answer.rounds]  # fmt: skip
    return [(answer.state, answer.outcome, *answer.named), *rounds]


def test_the_hours_end_it(location: str) -> None:
    answer, _ = begin_here(location, UNIT, DiagnosisRequest(hours=0.5), None)
    ended = diagnosis(location, one_after_two).run(answer.id)
    assert (ended.outcome, ended.spent_hours) == ("hours_spent", 0.0)
    assert "0.5 h of 0.5 h are left" in ended.why


@pytest.mark.slow
def test_a_recording_that_cannot_be_judged_with_the_others_is_left_out(location: str) -> None:
    def script(recordings: list[int]) -> CriticismResponse:
        if 2 in recordings:
            raise NotEnoughData("the recording has 1 temperature; measure at 2 more temperatures")
        if 3 in recordings:
            return criticism("missing", "warm_up", recordings=recordings)
        return criticism("ambiguous", "thermal_lag", "warm_up", experiments=[FIRST, SECOND], recordings=recordings)

    answer = run(location, script)
    assert [each.came for each in answer.rounds] == ["cannot_be_done", "measured", None]
    assert answer.rounds[0].came_text.startswith("recording 2 cannot be judged with the others, and is left out: the")
    assert (answer.outcome, answer.rounds[-1].recordings) == ("one_cause", [1, 3])
    assert answer.spent_hours == pytest.approx(sum(each.took_hours or 0.0 for each in answer.rounds))


@pytest.mark.slow
def test_what_is_next_is_the_version_that_was_made_with_the_effect(location: str) -> None:
    answer = run(location)
    assert answer.next == f"`labctl improve {UNIT} --version 1 --recording 1,2,3 --add warm_up`"
    made = ImproveRequest(version=1, recordings=answer.rounds[-1].recordings, add=["warm_up"], accept_warnings=True)
    with open_store(location, write=True) as store:
        version = improve_unit(store, UNIT, made, NOW).version
        found = diagnosis_answer(store, answer.id)
    said = f"version {version} contains what was found; `labctl criticise {UNIT} --version {version}` judges it"
    assert found.next == said


def test_a_unit_that_was_imported_needs_a_bench(location: str) -> None:
    with open_store(location, write=True) as store:
        with pytest.raises(BadInput, match="give --bench FILE"):
            begin.bench_of_unit(store, "MEMS-9", None)
        with pytest.raises(Conflict, match="not MEMS-9"):
            begin.bench_of_unit(store, "MEMS-9", load_bench("single-axis-sim"))


def test_there_is_one_open_diagnosis_of_a_unit(location: str) -> None:
    first, is_new = begin_here(location, UNIT, DiagnosisRequest(), None)
    again, is_new_again = begin_here(location, UNIT, DiagnosisRequest(), None)
    assert (first.id, is_new, is_new_again) == (again.id, True, False)
    with open_store(location, write=True) as store:
        with pytest.raises(Conflict, match="has not ended"):
            begin.begin(store, UNIT, DiagnosisRequest(), None, NOW)
        assert begin.end(store, first.id, "enough", NOW).outcome == "ended_by_person"
        assert begin.begin(store, UNIT, DiagnosisRequest(), None, NOW).id == first.id + 1


@pytest.fixture
def waiting(location: str) -> tuple[str, int]:
    """Return a database with a diagnosis on a real bench that waits for a person."""
    with open_store(location, write=True) as store:
        answer = begin.begin(store, UNIT, DiagnosisRequest(), None, NOW)
        _make_real(store, answer.id)
    answer = diagnosis(location, one_after_two).run(answer.id)
    assert (answer.state, answer.rounds[-1].campaign) == ("awaiting_confirmation", None)
    assert "confirm the experiment of round 1" in answer.next
    return location, answer.id


def _make_real(store: Store, number: int) -> None:
    """Give a diagnosis a bench with a port of this computer."""
    row = store.diagnoses.get(number)
    bench = {**row.bench, "table": {**row.bench["table"], "port": "/dev/ttyS9"}}
    with store.diagnoses._database.writing() as connection:
        import json

        from sqlalchemy import text

        connection.execute(text("UPDATE diagnoses SET bench = :bench"), {"bench": json.dumps(bench)})


def test_on_a_real_bench_a_person_confirms_each_experiment(waiting: tuple[str, int]) -> None:
    location, number = waiting
    with open_store(location, write=True) as store:
        with pytest.raises(StartNotConfirmed, match="limiter_on"):
            begin.answer_experiment(store, number, ConfirmExperimentRequest(round=1, by="Ann"), NOW)
        with pytest.raises(Conflict, match="round 2"):
            begin.answer_experiment(store, number, ConfirmExperimentRequest(round=2, by="Ann"), NOW)
        asked = ConfirmExperimentRequest(round=1, by="Ann", checks=list(BENCH_CHECKS))
        answer = begin.answer_experiment(store, number, asked, NOW)
        assert (answer.state, answer.rounds[0].confirmed_by) == ("measuring", "Ann")
        last = store.audit.rows()[-1]
        assert (last.action, last.detail["by"]) == ("diagnosis confirm", "Ann")


def test_a_person_who_answers_that_it_cannot_be_done_gets_the_next_best(waiting: tuple[str, int]) -> None:
    location, number = waiting
    with open_store(location, write=True) as store:
        refused = ConfirmExperimentRequest(round=1, by="Ann", confirmed=False, reason="no cold bath here")
        assert begin.answer_experiment(store, number, refused, NOW).state == "criticising"
    answer = diagnosis(location, one_after_two).run(number)
    assert answer.rounds[0].came_text == "cannot be done: no cold bath here (Ann); it is not proposed again"
    assert (answer.state, answer.rounds[1].experiment.do) == ("awaiting_confirmation", FIRST["do"])


def test_one_that_is_stopped_goes_on_where_it_was(waiting: tuple[str, int]) -> None:
    location, number = waiting
    with open_store(location, write=True) as store:
        assert begin.stop(store, number, "lunch", NOW).why == "lunch"
        with pytest.raises(Conflict):
            begin.stop(store, number, "again", NOW)
        assert begin.resume(store, number, "back", NOW).state == "awaiting_confirmation"
