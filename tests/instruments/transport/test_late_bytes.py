"""Bytes held back are late and not lost: the counter decides, and a stream that catches up has lost nothing."""

from __future__ import annotations

import numpy as np
import pytest

from instruments.transport.sample_timing import StreamTime

HZ, WRAP = 125.0, 16  #: STIM300 at 125 a second: its counter comes to the same number every 16 datagrams


def listen(held: dict[float, float], lost_at_s: float = 1e9, lost: int = 0, until_s: float = 12.0) -> tuple[int, float]:
    """Return how many readings are counted as lost in `until_s` s, and the largest gap of the times, s.

    `held` gives from when on bytes come so many seconds late. `lost` readings after `lost_at_s` never come; a counter
    of WRAP does not show them where that is a whole number of turns.
    """
    stream, counted, times = StreamTime(1 / HZ, 0.0), 0, []
    made = 0
    for now_s in np.arange(0.1, until_s, 0.1):
        late_s = next((by for since, by in sorted(held.items(), reverse=True) if now_s >= since), 0.0)
        due = int((now_s - late_s) * HZ + 1e-6)
        skipped = lost if now_s > lost_at_s else 0
        came = max(due - skipped - made, 0)
        if came:
            found, gone = stream.times(np.ones(came, dtype=np.int64), float(now_s), WRAP)
            counted, made = counted + gone, made + came
            times.append(found)
    return counted, float(np.diff(np.concatenate(times)).max())


@pytest.mark.parametrize("late_s", [0.1, 0.13, 0.26, 0.5])
def test_bytes_held_back_for_a_moment_are_neither_lost_nor_a_gap(late_s: float) -> None:
    counted, gap_s = listen({5.0: late_s, 5.4: 0.0})
    assert counted == 0
    assert gap_s < 1.5 / HZ


def test_bytes_held_back_again_and_again_are_not_lost() -> None:
    held = {1.0 + k: 0.14 if k % 2 else 0.0 for k in range(11)}
    held = {at + (0.3 if by else 0.0): by for at, by in held.items()}
    assert listen(held)[0] == 0


@pytest.mark.parametrize("turns", [1, 2, 5])
def test_whole_turns_of_the_counter_that_never_come_are_lost(turns: int) -> None:
    assert listen({}, 5.0, turns * WRAP)[0] == turns * WRAP


def test_it_is_open_for_a_second_whether_readings_are_late_or_lost() -> None:
    stream = StreamTime(1 / HZ, 0.0)
    for second in range(1, 4):
        stream.times(np.ones(125, dtype=np.int64), float(second), WRAP)
    stream.times(np.ones(105, dtype=np.int64), 4.0, WRAP)
    assert stream.is_late
    stream.times(np.ones(145, dtype=np.int64), 5.0, WRAP)
    assert not stream.is_late
