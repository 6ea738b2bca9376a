"""Formulas of unknown users: how many, how deep, and from how many threads at once."""

from __future__ import annotations

import gc
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from labctl.errors import BadInput, NotEnoughData
from labctl.fitting import fit
from labctl.fitting.effects import MAX_FORMULAS, formulas, read_formula, read_formulas
from labctl.fitting.effects.formula import DEEPEST
from labctl.services.effects import with_files
from tests.helpers.recordings import points

LINES = [f"f{n}: sin({n + 1} * table_rate_dps)" for n in range(MAX_FORMULAS)]


@pytest.fixture
def hasty() -> Iterator[None]:
    """Threads change places as often as they can, and memory is collected all the time."""
    interval, threshold = sys.getswitchinterval(), gc.get_threshold()
    sys.setswitchinterval(1e-6)
    gc.set_threshold(50)
    yield
    sys.setswitchinterval(interval)
    gc.set_threshold(*threshold)


class Garbage:
    """Refers to itself, so that collecting it, in the middle of whatever allocates, runs Python."""

    def __init__(self) -> None:
        self.own = self

    def __del__(self) -> None:
        sum(range(50))


@pytest.mark.slow
def test_fifty_threads_read_formulas_at_once(hasty: None) -> None:
    """Without a lock about one in 200 fails: `AST constructor recursion depth mismatch`."""
    texts = ["a: " + "+".join(f"(table_rate_dps*{n})" for n in range(20)), "a: " + "(" * 90 + "1" + ")" * 90]
    failed: list[BaseException] = []

    def read() -> None:
        try:
            for _ in range(60):
                Garbage()
                for text in texts:
                    read_formula(text)
        except BaseException as error:  # noqa: BLE001  errors of a thread are lost otherwise
            failed.append(error)

    threads = [threading.Thread(target=read) for _ in range(50)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failed == []


@pytest.mark.parametrize(
    "text",
    [
        "-" * 400 + "1",
        "(" * 240 + "1" + ")" * 240,
        "+".join("1" * 200),
        "1**" * 150 + "1",
    ],
)
def test_what_is_too_deep_is_refused_from_any_depth_of_calls(text: str) -> None:
    def below(calls: int) -> None:
        if calls:
            below(calls - 1)
            return
        with pytest.raises(
            BadInput, match=rf"formula 'a': (operations are nested more than {DEEPEST} levels deep|.* cannot be read)"
        ):
            read_formula(f"a: {text}")

    below(0)
    below(300)


def test_a_long_sum_is_read() -> None:
    assert read_formula("a: " + "+".join(f"{n}*t_s" for n in range(60))).text.startswith("0*t_s")


def test_at_most_so_many_at_once(tmp_path: Path) -> None:
    assert len(read_formulas(LINES)) == MAX_FORMULAS
    with pytest.raises(BadInput, match=f"more than {MAX_FORMULAS} formulas"):
        read_formulas([*LINES, "g: t_s"])
    with pytest.raises(BadInput, match=f"more than {MAX_FORMULAS} formulas"):
        read_formulas(LINES * 1000)
    with pytest.raises(BadInput, match="formula 'f3' is given twice"):
        read_formulas([*LINES[:5], "f3: t_s"])
    file = tmp_path / "many.toml"
    file.write_text("".join(f'[[effects]]\nid = "g{n}"\nformula = "t_s"\n' for n in range(MAX_FORMULAS + 1)))
    with pytest.raises(BadInput, match=f"more than {MAX_FORMULAS} formulas"):
        with_files([str(file)])
    assert len(formulas(str(file))) == MAX_FORMULAS + 1


@pytest.mark.timeout(10)
def test_more_unknowns_than_rows_are_refused_before_they_are_compared() -> None:
    rate = np.linspace(-100.0, 100.0, 30)
    recording = points(rate, np.full(30, 25.0), 1.01 * rate)
    with pytest.raises(NotEnoughData, match="more coefficients than the recording's 30 data sets determine"):
        fit(recording, None, ["bias"] * 3000)
