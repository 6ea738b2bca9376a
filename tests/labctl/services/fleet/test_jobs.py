"""Jobs over many units: each result once, whatever happens on the way, and what was done is not done again."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from concurrent.futures import CancelledError
from concurrent.futures.process import BrokenProcessPool
from datetime import timedelta
from pathlib import Path

import pytest

from instruments.clock import VirtualClock
from labctl.answers.calibrations import FitRequest
from labctl.answers.fleet import FleetCancelRequest, FleetJobRequest
from labctl.errors import BadInput, ComputationEnded, Conflict, NotCertified, NotFound
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.fleet import jobs
from labctl.services.fleet.foreground import this_process
from labctl.services.fleet.runner import LEFT_AFTER, TRIES, carry_out
from labctl.services.fleet.task import FleetTask
from labctl.store import Store, open_store
from labctl.store.paging import PageRequest
from tests.helpers.fleets import AT, HereEngine, add_units, run_job, unit_points
from tests.helpers.one_row_sets import one_row_sets

UNITS = 4
ALL: PageRequest[str] = PageRequest()


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        add_units(opened, UNITS)
        yield opened


def versions(store: Store) -> list[list[int]]:
    return [store.calibrations.versions(f"U{number:05d}") for number in range(UNITS)]


@pytest.mark.slow
def test_each_unit_gets_one_version_that_is_not_in_force_and_a_second_job_has_nothing_to_do(store: Store) -> None:
    first = run_job(store)
    assert (first.state, first.done, first.failed, first.waiting) == ("done", UNITS, 0, 0)
    assert versions(store) == [[1]] * UNITS
    with pytest.raises(NotCertified):
        store.calibrations.certified_version("U00000")
    assert first.processor_s_per_unit == pytest.approx(first.processor_s / UNITS)
    assert first.processor_s > 0.0
    second = run_job(store)
    assert (second.done, second.skipped, second.processor_s_per_unit) == (0, UNITS, None)
    assert versions(store) == [[1]] * UNITS
    reasons = {row.reason for row in jobs.unit_answers(store, second.id, ALL).rows}
    assert reasons == {"version 1 is this fit already, by the same recordings, model and program"}
    assert run_job(store, again=True).done == UNITS


def test_the_fit_of_a_job_is_that_of_a_single_unit(store: Store) -> None:
    alone = fit_unit(store, "U00001", FitRequest(effects=["bias", "scale_factor"]), AT)
    run_job(store, search="U00001")
    kept = store.calibrations.get("U00001", 2).answer
    assert kept["axes"] == alone.model_dump(mode="json")["axes"]


@pytest.mark.slow
def test_what_changed_since_is_computed_again(store: Store) -> None:
    run_job(store)
    store.recordings.add_import(unit_points(2), AT)  # a new recording
    fit_unit(store, "U00003", FitRequest(effects=["bias"]), AT)  # another newest version
    again = run_job(store)
    assert (again.done, again.skipped) == (2, 2)
    assert versions(store) == [[1], [1], [1, 2], [1, 2, 3]]
    assert run_job(store, effects=["bias"]).done == UNITS  # another model


@pytest.mark.slow
def test_a_criticism_is_written_once_and_its_verdict_kept(store: Store) -> None:
    run_job(store)
    judged = run_job(store, kind="criticise")
    assert (judged.done, judged.failed) == (UNITS, 0)
    rows = store.fleet.units(judged.id, ALL).rows
    assert {row.verdict for row in rows} == {"adequate"}
    assert run_job(store, kind="criticise").skipped == UNITS
    assert run_job(store, kind="criticise", model="custom").units == UNITS
    with pytest.raises(NotFound, match="error model 'ojeda2000'"):
        run_job(store, kind="criticise", model="ojeda2000")


@pytest.mark.slow
def test_a_unit_that_cannot_be_fitted_has_its_reason_and_the_others_go_on(store: Store) -> None:
    store.recordings.add_import(one_row_sets(1, "A-1"), AT)
    job = run_job(store)
    assert (job.state, job.done, job.failed) == ("done", UNITS, 1)
    (failed,) = jobs.unit_answers(store, job.id, ALL, "failed").rows
    assert failed.serial == "A-1"
    assert failed.reason
    assert failed.version is None


@pytest.mark.slow
def test_a_job_that_is_cancelled_keeps_what_was_written_and_the_next_one_goes_on_there(store: Store) -> None:
    def cancel(answer: jobs.FleetJobResponse) -> None:
        if answer.done == 2:
            jobs.cancel(store, answer.id, FleetCancelRequest(by="Ann", reason="wrong model"), AT)

    job = run_job(store, told=cancel)
    assert (job.state, job.done, job.waiting) == ("cancelled", 2, 2)
    assert job.why == "cancelled by Ann: wrong model"
    with pytest.raises(Conflict, match="has ended"):
        jobs.cancel(store, job.id, FleetCancelRequest(), AT)
    rest = run_job(store)
    assert (rest.skipped, rest.done) == (2, 2)
    assert versions(store) == [[1]] * UNITS


@pytest.mark.slow
def test_an_interrupt_ends_a_job_as_a_cancel_does(store: Store) -> None:
    def interrupt(task: FleetTask) -> None:
        if task.serial == "U00002":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_job(store, HereEngine(store, interrupt))
    (row,) = store.fleet.page(PageRequest()).rows
    assert (row.state, store.fleet.counts(row.id).done) == ("cancelled", 2)


@pytest.mark.slow
@pytest.mark.parametrize("error", [ComputationEnded("killed"), BrokenProcessPool("died")])
def test_a_unit_whose_worker_died_is_tried_again_last_and_given_up_after_some_times(
    store: Store, error: Exception
) -> None:
    begun: list[str] = []

    def die(task: FleetTask) -> None:
        begun.append(task.serial)
        if task.serial == "U00000" or (task.serial == "U00001" and begun.count("U00001") == 1):
            raise error

    job = run_job(store, HereEngine(store, die))
    assert (job.state, job.done, job.failed) == ("done", UNITS - 1, 1)
    assert Counter(begun) == {"U00000": TRIES, "U00001": 2, "U00002": 1, "U00003": 1}
    assert begun[:UNITS] == sorted(set(begun))
    (failed,) = jobs.unit_answers(store, job.id, ALL, "failed").rows
    assert f"{TRIES} times" in failed.reason


@pytest.mark.slow
def test_an_engine_that_was_lost_with_all_that_it_had_loses_nothing_and_writes_nothing_twice(store: Store) -> None:
    begun: list[str] = []

    def lose(task: FleetTask) -> None:
        begun.append(task.serial)
        if len(begun) in {2, 3}:
            raise CancelledError

    engine = HereEngine(store, lose, at_once=3)
    job = run_job(store, engine)
    assert engine.reconnected
    assert (job.done, job.failed) == (UNITS, 0)
    assert versions(store) == [[1]] * UNITS


@pytest.mark.slow
def test_a_version_that_another_fit_took_is_made_again_with_the_next_number(store: Store) -> None:
    made: list[str] = []

    class Slow(HereEngine):
        def submit(self, task: FleetTask) -> object:  # type: ignore[override]
            done = super().submit(task)
            if not made:
                made.append(task.serial)
                fit_unit(store, task.serial, FitRequest(effects=["bias"]), AT)
            return done

    job = run_job(store, Slow(store))
    assert (job.done, job.failed) == (UNITS, 0)
    assert versions(store) == [[1, 2], [1], [1], [1]]


@pytest.mark.slow
def test_a_job_is_carried_out_by_one_process_and_taken_up_when_that_one_is_gone(store: Store) -> None:
    clock = VirtualClock(AT)
    request = FleetJobRequest(kind="fit", effects=["bias"])
    job = jobs.begin(store, request, AT, "another process")
    carry_out(store, clock, job.id, this_process(), lambda: HereEngine(store))
    assert jobs.job_answer(store, job.id, AT).done == 0
    clock.sleep((LEFT_AFTER + timedelta(seconds=1)).total_seconds())
    over = iter([False, False, True])
    carry_out(store, clock, job.id, this_process(), lambda: HereEngine(store), over=lambda: next(over))
    left = jobs.job_answer(store, job.id, clock.utc())
    assert (left.state, left.done, left.waiting) == ("waiting", 2, 2)  # its service has ended
    carry_out(store, clock, job.id, "the next service", lambda: HereEngine(store))
    assert jobs.job_answer(store, job.id, clock.utc()).state == "done"
    assert versions(store) == [[1]] * UNITS


@pytest.mark.slow
def test_a_job_is_not_left_for_good_where_the_clock_was_set_back(store: Store) -> None:
    job = jobs.begin(store, FleetJobRequest(kind="fit", effects=["bias"]), AT, "another process")
    for back, done in ((LEFT_AFTER / 2, 0), (timedelta(days=1), UNITS)):
        carry_out(store, VirtualClock(AT - back), job.id, this_process(), lambda: HereEngine(store))
        assert jobs.job_answer(store, job.id, AT).done == done


def test_an_engine_that_does_not_answer_ends_the_job_with_the_reason(store: Store) -> None:
    def nothing() -> HereEngine:
        raise ComputationEnded("no scheduler")

    job = jobs.begin(store, FleetJobRequest(kind="fit", effects=["bias"]), AT)
    with pytest.raises(ComputationEnded):
        carry_out(store, VirtualClock(AT), job.id, "me", nothing)
    answer = jobs.job_answer(store, job.id, AT)
    assert (answer.state, answer.why, answer.waiting) == ("failed", "no scheduler", UNITS)


def test_another_program_is_refused_before_anything_is_written(store: Store) -> None:
    from labctl.services.fleet.task import refuse_other_program

    refuse_other_program("")
    with pytest.raises(BadInput, match="another version"):
        refuse_other_program("0" * 64)


def test_requests_that_cannot_be_done_are_refused(store: Store) -> None:
    for request, said in (
        (FleetJobRequest(kind="fit"), "give the model"),
        (FleetJobRequest(kind="fit", model="cubic"), "not known"),
        (FleetJobRequest(kind="criticise", effects=["bias"]), "leave them out"),
    ):
        with pytest.raises(BadInput, match=said):
            jobs.begin(store, request, AT)
    with pytest.raises(NotFound, match="no unit matches"):
        jobs.begin(store, FleetJobRequest(kind="criticise", type="MEMS-B"), AT)
    assert store.fleet.page(PageRequest()).rows == []
