"""Stopping a bench at its instruments: what is opened, what is tried, and what is said of the parts that answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import pytest

from instruments.bench_config import BenchFile, read_bench
from instruments.clock import SystemClock
from instruments.errors import NoReply
from labctl.stop import instruments_stop
from labctl.stop.instruments_stop import InstrumentsLeft, stop_instruments

TABLE, CHAMBER = "table to rest", "chamber to its safe set point"
DOCUMENT = read_bench("example-real").model_dump(mode="json", exclude_none=True)


@dataclass
class Bench:
    """A bench whose parts answer as a test says."""

    tries: list[tuple[str, str]] = field(default_factory=list)
    complaints: tuple[str, ...] = ()
    at_open: Exception | None = None
    opened: list[BenchFile] = field(default_factory=list)
    pauses_s: list[tuple[float, ...]] = field(default_factory=list)
    closed: int = 0

    def open_bench(self, bench: BenchFile, clock: object) -> Any:
        assert isinstance(clock, SystemClock)
        if self.at_open:
            raise self.at_open
        self.opened.append(bench)
        return SimpleNamespace(close=self.close)

    def close(self) -> None:
        self.closed += 1

    def make_safe(
        self, _bench: object, clock: object, pauses_s: tuple[float, ...], note: Callable[[str, str], None]
    ) -> tuple[str, ...]:
        assert isinstance(clock, SystemClock)
        self.pauses_s.append(pauses_s)
        for each in self.tries:
            note(*each)
        return self.complaints


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    made = Bench()
    monkeypatch.setattr(instruments_stop, "open_bench", made.open_bench)
    monkeypatch.setattr(instruments_stop, "make_safe", made.make_safe)
    return made


def left_after(document: dict[str, Any] = DOCUMENT) -> tuple[InstrumentsLeft, list[str]]:
    """Return how the bench was left, and what was said meanwhile, in its order."""
    said: list[str] = []
    return stop_instruments(document, said.append, lambda: said.append("it stands")), said


def test_table_and_chamber_are_tried_twice_and_no_unit_is_opened(bench: Bench) -> None:
    """A port that the process before had open is free a moment later; a unit is nothing that moves."""
    bench.tries = [(TABLE, ""), (CHAMBER, "")]
    assert left_after() == (InstrumentsLeft(True, True, "table at rest, chamber at its safe set point"), ["it stands"])
    (opened,) = bench.opened
    assert (opened.gyros, opened.references) == ((), ())
    assert opened.table is not None
    assert opened.chamber is not None
    assert (bench.pauses_s, bench.closed) == ([(0.5,)], 1)
    assert stop_instruments(DOCUMENT).stands is True  # also where nothing is to be said


def test_a_bench_is_named_by_the_parts_that_it_has(bench: Bench) -> None:
    bench.tries = [(TABLE, "")]
    for without, text in (
        (("chamber",), "table at rest"),
        (("table",), "chamber at its safe set point"),
        (("chamber", "table"), "nothing on this bench moves by itself"),
    ):
        found, said = left_after({key: value for key, value in DOCUMENT.items() if key not in without})
        assert (found, said) == (InstrumentsLeft(True, True, text), ["it stands"])


def test_a_table_that_stands_counts_also_while_the_chamber_does_not_answer(bench: Bench) -> None:
    bench.tries = [(TABLE, "no answer"), (CHAMBER, "no answer"), (TABLE, ""), (CHAMBER, "no answer")]
    bench.complaints = ("chamber to its safe set point: no answer", "stream of fog closed: no answer")
    found, said = left_after()
    assert found == InstrumentsLeft(True, False, "; ".join(bench.complaints))
    assert said == [f"{TABLE}: no answer", f"{CHAMBER}: no answer", "it stands", f"{CHAMBER}: no answer"]


def test_a_table_that_does_not_answer_does_not_stand(bench: Bench) -> None:
    bench.tries = [(TABLE, "no answer"), (CHAMBER, ""), (TABLE, "no answer")]
    bench.complaints = ("table to rest: no answer",)
    found, said = left_after()
    assert found == InstrumentsLeft(False, False, "table to rest: no answer")
    assert said == [f"{TABLE}: no answer"] * 2


def test_instruments_that_cannot_be_reached_are_not_known_to_stand(bench: Bench) -> None:
    bench.at_open = NoReply("table", "no answer")
    found, said = left_after()
    assert (found.stands, found.safe, said) == (False, False, [])
    assert found.text == "the instruments cannot be reached: table: no answer"
    found, _ = left_after({"name": "b", "table": {"driver": 3}})
    assert (found.stands, found.safe) == (False, False)
    assert found.text.startswith("the instruments cannot be reached: ")
