"""`make mutants [MODULES="NAME ..."]`: mutate the modules of targets.toml and print which mutants no test notices."""

from __future__ import annotations

import argparse
import json
import signal
import sys
from pathlib import Path

from mutants.isolated import BESIDES_S, NOTHING_COLLECTED, PASSED, TIMES, Runner, copy_of
from mutants.namespace import run_apart
from mutants.operators import Mutant, mutants_of
from mutants.targets import Target, targets

ROOT = Path(__file__).resolve().parents[1]
#: The least share of the mutants of a module, without those that are equivalent, that the tests are to notice.
LEAST = 0.90


def main() -> int:
    """Run the mutants of the modules that are named, or of all; returns 1 when the tests of one notice too few."""
    arguments = _arguments()
    if (status := run_apart(sys.argv[1:])) is not None:
        return status
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended by a signal"))  # the copy is removed
    wanted = [each for each in targets() if not arguments.modules or any(n in each.module for n in arguments.modules)]
    before = json.loads(arguments.survivors.read_text()) if arguments.again else {}
    left: dict[str, list[str]] = {}
    rows = []
    with copy_of(ROOT) as copy:
        runner = Runner(ROOT, copy)
        for target in wanted:
            rows.append(_judged(runner, target, set(before.get(target.module, ())) if arguments.again else None, left))
            if arguments.survivors:
                arguments.survivors.write_text(json.dumps(before | left, indent=1), encoding="utf-8")
    width = max(len(target.module) for target in wanted)
    print(f"\n{'module':{width}}  mutants  killed  equivalent  survived  killed of those that can be")
    for target, (mutants, killed, equivalent) in zip(wanted, rows, strict=True):
        share = killed / max(mutants - equivalent, 1)
        survived = mutants - killed - equivalent
        print(f"{target.module:{width}}  {mutants:7}  {killed:6}  {equivalent:10}  {survived:8}  {share:.1%}")
    return int(any(killed < LEAST * (mutants - equivalent) for mutants, killed, equivalent in rows))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m mutants", description=__doc__)
    parser.add_argument("modules", nargs="*", help="parts of file names; all modules where none is given")
    parser.add_argument("--survivors", type=Path, help="a JSON file to keep the survivors in")
    parser.add_argument("--again", action="store_true", help="run only those that the file of survivors names")
    return parser.parse_args()


def _judged(runner: Runner, target: Target, only: set[str] | None, left: dict[str, list[str]]) -> tuple[int, int, int]:
    """Return how many mutants a module has, how many were noticed, and how many cannot be; `left` gets the rest."""
    source = (ROOT / target.module).read_text(encoding="utf-8")
    plain = runner.load_for(target.module, target.tests)
    if plain.status != PASSED:
        what = (
            "hold no test" if plain.status == NOTHING_COLLECTED else f"fail without any mutant (status {plain.status})"
        )
        sys.exit(f"{target.module}: its tests {what}; mend them, or name others in targets.toml\n{plain.output}")
    found = [each for each in mutants_of(source) if only is None or each.text in only]
    same = [each for each in found if target.why_equivalent(each) is not None]
    print(f"\n{target.module}: {len(found)} mutants, tests {plain.took_s:.1f} s", flush=True)
    survivors = [each for each in found if each not in same and _survives(runner, target, each, plain.took_s)]
    left[target.module] = [each.text for each in survivors]
    return len(found), len(found) - len(same) - len(survivors), len(same)


def _survives(runner: Runner, target: Target, mutant: Mutant, plain_s: float) -> bool:
    outcome = runner.run(target.module, mutant.code, target.tests, TIMES * plain_s + BESIDES_S)
    if outcome.survived:
        print(f"  {mutant.operator}, {mutant.text}", flush=True)
    return outcome.survived


if __name__ == "__main__":
    sys.exit(main())
