"""Handing a line to the log never blocks the caller: not a reader that stands still, a full disk, or no output at
all."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator

import pytest

from labctl.log.writer import LogWriter, takes_text

SOON_S = 20.0


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    reading, writing = os.pipe()
    yield reading, writing
    os.close(reading)


def everything(reading: int) -> list[str]:
    """Return the lines that came through a pipe whose other end is closed."""
    with os.fdopen(os.dup(reading), "rb") as file:
        return file.read().decode().splitlines()


def test_lines_come_out_in_order_and_whole(pipe: tuple[int, int]) -> None:
    reading, writing = pipe
    writer = LogWriter(writing)
    reported = [f"line {number} {'x' * number * 10}" for number in range(60)]
    for line in reported:
        writer.put(line)
    writer.close(SOON_S)
    assert everything(reading) == reported
    assert writer.lost == 0


def test_a_reader_that_stands_still_costs_records_and_no_time(pipe: tuple[int, int]) -> None:
    """The pipe is full, the writing thread blocks in it: the caller that hands a line over does not."""
    reading, writing = pipe
    writer = LogWriter(writing, capacity=100, notes=lambda lost: [f"{lost} lost"] if lost else [])
    handed_over = threading.Event()

    def hand_over() -> None:
        for _ in range(1000):
            writer.put("x" * 4096)
        handed_over.set()

    threading.Thread(target=hand_over, daemon=True).start()
    assert handed_over.wait(SOON_S)
    assert writer.lost >= 1000 - 100 - 64
    assert not writer.flush(within_s=0.05)  # the end of a process does not wait for such a reader either
    lost = writer.lost
    lines: list[str] = []
    reader = threading.Thread(target=lambda: lines.extend(everything(reading)), daemon=True)
    reader.start()
    writer.close(SOON_S)
    reader.join(SOON_S)
    assert [line for line in lines if line.endswith(" lost")] == [f"{lost} lost"]
    assert len(lines) == 1000 - lost + 1


def test_a_full_disk_costs_records_and_nothing_else() -> None:
    writer = LogWriter(os.open("/dev/full", os.O_WRONLY))
    for _ in range(5):
        writer.put("a line")
    assert writer.flush(SOON_S)
    assert writer.lost == 5
    writer.close(SOON_S)


def test_a_broken_pipe_costs_records_and_nothing_else() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    writer = LogWriter(writing)
    writer.put("a line")
    assert writer.flush(SOON_S)
    assert writer.lost == 1
    writer.close(SOON_S)


def test_a_process_without_an_output_has_nothing_to_write_to() -> None:
    writer = LogWriter(None)
    writer.put("a line")
    assert writer.flush(SOON_S)
    assert writer.lost == 1
    writer.close(SOON_S)


def test_an_output_that_does_not_block_gets_everything_once_it_takes_it(pipe: tuple[int, int]) -> None:
    reading, writing = pipe
    os.set_blocking(writing, False)
    writer = LogWriter(writing)
    for _ in range(40):
        writer.put("x" * 4096)
    lines: list[str] = []
    reader = threading.Thread(target=lambda: lines.extend(everything(reading)), daemon=True)
    reader.start()
    writer.close(SOON_S)
    reader.join(SOON_S)
    assert (len(lines), writer.lost) == (40, 0)


def test_lost_lines_are_reported_once(pipe: tuple[int, int]) -> None:
    reading, writing = pipe
    writer = LogWriter(writing, notes=lambda lost: [f"{lost} lost"] if lost else [], notes_every_s=0.01)
    writer.lost = 3
    assert os.read(reading, 100) == b"3 lost\n"  # without a further line
    writer.put("next")
    writer.close(SOON_S)
    assert everything(reading) == ["next"]


def test_the_end_does_not_wait_for_a_reader_that_stands_still(pipe: tuple[int, int]) -> None:
    reading, writing = pipe
    assert takes_text(writing)
    writer = LogWriter(os.dup(writing))
    for _ in range(100):
        writer.put("x" * 4096)
    writer.close(within_s=3600.0)  # the time of this test is bounded
    assert writer._thread.is_alive()
    assert not takes_text(writing)
    os.close(writing)
    assert len(everything(reading)) == 100  # the reader goes on: nothing was lost
