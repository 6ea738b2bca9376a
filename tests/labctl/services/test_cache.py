"""Answers that are kept: when they are taken again, when they must not be, and that a bad cache costs only time."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from instruments.plugins import Plugin, installed
from labctl.answers.base import ResponseModel
from labctl.answers.certification import CertificationResponse
from labctl.answers.ladder import LadderResponse
from labctl.recording import to_points, write_recording
from labctl.services import cache as result_cache
from labctl.services.cache import RecentResults, cached, cached_group
from labctl.services.criticism import evaluation, measurements
from labctl.store import open_store
from tests.helpers.lab import Lab
from tests.helpers.simulated_recordings import single_axis

CERTIFIED = {"serial": "A", "version": 1, "act": "certify", "by": "B", "reason": "C", "at": "2026-01-05T08:00Z"}


class Work:
    """Something that takes long, counted."""

    def __init__(self) -> None:
        self.times = 0

    def __call__(self) -> LadderResponse:
        self.times += 1
        return LadderResponse(serial="A", steps=[], noise_floor_dps=1 / 3)


@pytest.fixture
def work() -> Work:
    return Work()


@pytest.fixture
def ask(work: Work) -> Callable[..., LadderResponse]:
    return lambda **question: cached(LadderResponse, question, work)


def test_the_same_question_is_answered_once(work: Work, ask: Callable[..., LadderResponse]) -> None:
    first = ask(version=1)
    assert ask(version=1) == first
    assert work.times == 1
    ask(version=2)
    assert work.times == 2


def test_whoever_asks_the_same_meanwhile_waits_for_the_answer() -> None:
    begun, go_on, times = threading.Event(), threading.Event(), []

    def work() -> list[ResponseModel]:
        times.append(1)
        begun.set()
        go_on.wait(30)
        return [
            LadderResponse(serial="A", steps=[], noise_floor_dps=1.0),
            CertificationResponse.model_validate(CERTIFIED),
        ]

    with ThreadPoolExecutor(2) as pool:
        first = pool.submit(cached_group, LadderResponse, {"version": 1}, work)
        assert begun.wait(30)
        second = pool.submit(cached_group, CertificationResponse, {"version": 1}, work)
        go_on.set()
        assert (first.result().serial, second.result().by) == ("A", "B")
    assert len(times) == 1


def test_other_code_answers_anew(
    work: Work, ask: Callable[..., LadderResponse], monkeypatch: pytest.MonkeyPatch
) -> None:
    ask(version=1)
    monkeypatch.setattr(result_cache, "code_digest", lambda: "changed")
    ask(version=1)
    assert work.times == 2


def test_another_package_with_an_effect_answers_anew(
    work: Work, ask: Callable[..., LadderResponse], monkeypatch: pytest.MonkeyPatch
) -> None:
    ask(version=1)
    other = Plugin("labctl.effects", "acme", "acme:EFFECT", "acme-effects", "0.1")
    with monkeypatch.context() as patched:
        patched.setattr(result_cache, "installed", lambda: (*installed(), other))
        result_cache.code_digest.cache_clear()
        ask(version=1)
    result_cache.code_digest.cache_clear()
    ask(version=1)
    assert work.times == 2


def test_a_damaged_answer_is_worked_out_again(work: Work, ask: Callable[..., LadderResponse], cache: Path) -> None:
    first = ask(version=1)
    (file,) = cache.rglob("*.json")
    file.write_bytes(file.read_bytes()[:20])
    assert ask(version=1) == first
    assert work.times == 2
    assert ask(version=1) == first
    assert work.times == 2


def test_a_cache_that_cannot_be_written_costs_only_time(
    work: Work, ask: Callable[..., LadderResponse], cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (cache / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache / "file"))
    assert ask(version=1) == ask(version=1)
    assert work.times == 2


def test_the_oldest_go(ask: Callable[..., LadderResponse], cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(result_cache.RESPONSES, "most", 3)
    for version in range(6):
        ask(version=version)
    assert len(list(cache.rglob("*.json"))) == 3


@pytest.mark.slow
def test_a_recording_that_differs_in_one_reading_is_another(tmp_path: Path) -> None:
    one = single_axis(1)
    other = single_axis(1)
    other.columns["gyro_z"][1000] += 1e-6
    prints = []
    for name, recording in (("a", one), ("b", one), ("c", other)):
        with open_store(str(tmp_path / f"{name}.sqlite"), write=True) as store:
            number = store.recordings.add_import(recording, recording.info.started_at)
            prints.append(store.recordings.fingerprint(number))
    assert prints[0] == prints[1] != prints[2]


@pytest.mark.slow
def test_criticise_looks_at_the_readings_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:

    lab = Lab(tmp_path)
    lab.run("simulate", "ojeda2000-121", "--out", str(tmp_path / "in"), "--seed", "2")
    lab.run("import", str(tmp_path / "in"))
    lab.run("fit", "FOG-0001", "--model", "ojeda2000")
    first = lab.json("criticise", "FOG-0001")

    def never(*_: object) -> None:
        raise AssertionError("read again")

    monkeypatch.setattr(measurements, "_reduced_readings", never)
    assert lab.json("criticise", "FOG-0001") == first
    with pytest.raises(AssertionError, match="read again"):
        lab.run("criticise", "FOG-0001", "--formula", "wet: supply_v - 5")


def test_threads_that_ask_the_same_at_once_share_one_result_in_memory() -> None:
    recent: RecentResults[list[int]] = RecentResults(most=2)
    begun, go_on, times = threading.Event(), threading.Event(), []

    def work() -> list[int]:
        times.append(1)
        begun.set()
        assert go_on.wait(30)
        return [len(times)]

    with ThreadPoolExecutor(2) as pool:
        first = pool.submit(recent.get, "same", work)
        assert begun.wait(30)
        second = pool.submit(recent.get, "same", work)
        go_on.set()
        assert first.result() is second.result()
    assert len(times) == 1


def test_of_results_in_memory_only_those_used_last_stay() -> None:
    recent: RecentResults[str] = RecentResults(most=2)
    made: list[str] = []

    def ask(question: str) -> str:
        def work() -> str:
            made.append(question)
            return question

        return recent.get(question, work)

    for question in "abacbc":
        assert ask(question) == question
    assert made == ["a", "b", "c", "b"]


@pytest.mark.slow
def test_a_fit_of_the_same_readings_at_another_time_is_criticised_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_recording(to_points(single_axis(1)), tmp_path / "in")
    answers, hashes = [], set()
    for place in ("first", "second"):
        (tmp_path / place).mkdir()
        lab = Lab(tmp_path / place)
        lab.run("import", str(tmp_path / "in"))
        hashes.add(lab.json("fit", "FOG-0001", "--model", "bias_scale")["hash"])
        answers.append(lab.json("criticise", "FOG-0001"))
        monkeypatch.setattr(evaluation, "criticise", None)
    assert len(hashes) == 2
    assert answers[0] == answers[1]
