"""Two real processes, one bench on real ports: the second is refused, takes over after a kill, never do both move."""

from __future__ import annotations

import signal

from tests.helpers.forked_commands import run_labctl
from tests.helpers.patience import WAIT_S
from tests.helpers.simulator_process import FIRST_DPS, SECOND_DPS, Simulator


def speed_command(rate_dps: float) -> str:
    """What the table hears before it turns so fast."""
    return f"!1sp1,{round(2_000_000 * 0.225 / rate_dps)}"


def test_the_second_is_refused_and_takes_over_when_the_first_is_killed(simulator: Simulator) -> None:
    first = simulator.drive(FIRST_DPS, "lab.sqlite")
    simulator.wait_for("!1m1")
    first.send_signal(signal.SIGSTOP)  # it hangs, while its table turns: nothing that it could do ends this by itself
    held = f"bench single-axis-sim is in use by process {first.pid} on "
    assert held in simulator.refused("lab.sqlite")
    # another database knows nothing of that lease, but the ports are taken
    said = simulator.refused("other.sqlite")
    assert "table: port /dev/" in said
    assert "cannot be opened" in said
    assert f"process {first.pid} " in said
    heard_before_the_kill = len(simulator.heard)
    first.send_signal(signal.SIGKILL)
    first.wait(timeout=WAIT_S)
    assert "labctl campaign abort 1" in simulator.refused("lab.sqlite")  # a person decides about what was left
    for decided in (["campaign", "abort", "1"], ["bench", "clear", "single-axis-sim", "--by", "Ada"]):
        done = run_labctl([*decided, "--database", str(simulator.folder / "lab.sqlite")])
        assert done.returncode == 0, done.stderr
    second = simulator.drive(SECOND_DPS, "lab.sqlite")
    simulator.wait_for(speed_command(SECOND_DPS))
    simulator.wait_for("!1m1")
    second.send_signal(signal.SIGTERM)
    assert second.wait(timeout=WAIT_S) == 130
    simulator.close()
    by = [
        [at for at, line in enumerate(simulator.heard) if line["heard"].startswith(speed_command(rate))]
        for rate in (FIRST_DPS, SECOND_DPS)
    ]
    assert max(by[0]) < heard_before_the_kill <= min(by[1])
    table = [line for line in simulator.heard if line["device"] == "table"]
    aborts = [line for line in table if "!1a" in line["heard"]]
    assert [line["table_turns"] for line in aborts[:2]] == [True, True]  # the killed one's last move, then its own
    moves = [line for line in table if line["heard"].startswith(("!1m1", "!1h1"))]
    assert moves
    assert not any(line["table_turns"] for line in moves), moves
