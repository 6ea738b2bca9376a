"""What earlier campaigns of a bench, in the database, tell of the time that its steps take."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING

from pydantic import TypeAdapter

from instruments.bench_config import BenchFile, is_simulated_address
from labctl.errors import StoreError
from labctl.texts import counted
from procedures.contracts.steps import CheckHome, Home, Mount, MoveChamber
from procedures.planning.earlier_times import ChamberMoves, DoneStep, EarlierTimes, earlier_times

if TYPE_CHECKING:
    from labctl.store import Store

#: Of how many campaigns, the newest ones: a bench changes.
MAX_CAMPAIGNS = 20
KINDS = ("home", "check_home", "mount", "move_chamber")
_STEP: TypeAdapter[Home | CheckHome | Mount | MoveChamber] = TypeAdapter(Home | CheckHome | Mount | MoveChamber)


def times_on_bench(store: Store | None, bench: BenchFile) -> EarlierTimes | None:
    """Return what earlier campaigns took on a bench: those of its name with the same instruments; None for none.

    A campaign of the same name counts as far as its table and its chamber have the drivers of this bench, are simulated
    or not as these are, and the chamber has the same ramp. None also where the database cannot be read: a forecast
    does without.
    """
    if store is None:
        return None
    done: list[DoneStep] = []
    with suppress(StoreError):
        for row in store.campaigns.done_steps(bench.name, KINDS, MAX_CAMPAIGNS):
            step = _STEP.validate_python(row.body)
            if _is_same(row.bench, bench, "chamber" if isinstance(step, MoveChamber) else "table"):
                done.append(DoneStep(row.campaign, step, row.took_s))
    stated = bench.chamber.ramp_c_per_min if bench.chamber is not None else 1.0
    return earlier_times(done, stated)


def _is_same(earlier: Mapping[str, object], bench: BenchFile, name: str) -> bool:
    """Return whether the table or chamber of an earlier bench file is that of this one, as far as times are by it."""
    now = bench.table if name == "table" else bench.chamber
    then = earlier.get(name)
    if now is None or not isinstance(then, Mapping):
        return False
    links = [str(then[key]) for key in ("port", "host") if then.get(key) is not None]
    simulated = any(is_simulated_address(link) for link in links)
    is_simulated = any(is_simulated_address(link) for link in (now.port, now.host) if link is not None)
    ramp = getattr(now, "ramp_c_per_min", None)
    return (then.get("driver"), simulated, then.get("ramp_c_per_min")) == (now.driver, is_simulated, ramp)


def learned_texts(earlier: EarlierTimes | None, *, needs_person: bool) -> Iterator[str]:
    """Yield what the expected time of a plan takes from earlier campaigns, in words."""
    if earlier is None:
        return
    source = f"from {counted(earlier.campaigns, 'campaign')} on this bench"
    if earlier.home_s is not None:
        yield f"homing takes {earlier.home_s:.0f} s, {source}"
    if earlier.check_home_s is not None:
        yield f"a check for missed steps takes {earlier.check_home_s:.0f} s, {source}"
    if earlier.mount_s is not None and needs_person:
        yield f"a person takes {earlier.mount_s / 60:.1f} min to mount the units, {source}"
    for what, moves in (("heats", earlier.heating), ("cools", earlier.cooling)):
        if moves is not None:
            yield f"the chamber {what} {_moved(moves)}, {source} ({moves.moves} moves)"


def _moved(moves: ChamberMoves) -> str:
    ramp = "" if moves.ramp_c_per_min is None else f"by {moves.ramp_c_per_min:.2g} K/min, "
    settling = "as the ramp ends" if moves.settling_s <= 0 else f"{moves.settling_s:.0f} s after the ramp"
    return f"{ramp}and its air has settled {settling}"
