"""The page of real gyros: tables of quantities, verdicts and peers as Markdown."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Iterator, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from studies.real.comparison import Compared, all_compared, figures
from studies.real.peers import Peer, lines

PAGE = Path(__file__).resolve().parents[2] / "docs" / "explanation" / "real-gyros.md"
#: What the tables hang on.
DISTRIBUTIONS = ("numpy", "scipy", "imucal", "allantools")
HEAD = """\
# Real gyros

Every public recording that labctl may carry, what labctl says of it, and an independent analysis beside it. The
tables are printed by `python -m studies real`; `python -m studies.real.write` writes this page. The files are
in `examples/published`, where README.md names authors and licences.
labctl is asked on its command line, as in [from a file to a
calibration](../how-to/from-a-file-to-a-calibration.md). The independent analyses, `studies/real/independent`,
import numpy and scipy only and have formulas of their own.

Values are value +- U (k = 2); where no U stands, an analysis states none. *Difference* is labctl's value minus
the other in labctl's standard uncertainties. Both come from the same readings, so an error of the data shows in
neither. Agreement: *yes* within 2 u; of errors *same* within 5 %."""
NOTES = """\
- Which quiet stretches of a session count as rests moves elements of the matrix, and is in no uncertainty,
  neither labctl's nor the other's: with the rests that labctl finds, the independent analysis of mpu9150-2 has
  7.5 +- 1.6 in the place of the element that disagrees (labctl 7.9 +- 2.4, published 8.4), and one more rest of
  1.7 s changes an element of mpu9150-1 by 2 in 1e-3.
- At rest labctl's U is 1.5 to 6 times that of the independent analysis: it takes slow wandering for drift that
  lasts for minutes, the other takes stretches of 2 min, or bursts, for independent. These data do not tell
  which is right.
- Where the autopilots' cubic has less error than labctl's parabola, the bias is no parabola by more than the
  criticism finds significant: `labctl fit PAN-2020 --effects bias,bias_temperature:3` leaves 0.0069 deg/s in
  the place of 0.0073.
- In poses no criticism is possible, and of sessions with one turn about each axis neither a criticism nor a
  held-out error."""
THERMAL = """\
The autopilots' formulas fit cubics to the samples (the same numbers as the programs' own functions, to 1e-11
deg/s). Each eighth of the temperatures is left out in turn; the error is that of means over 17 s, or of bursts,
all methods on the same ones. The coldest eighth of the warm-up spans 11 K, and a cubic that has not seen it
strays. Simulated loops with a lag or a hysteresis, leg by leg, are in [fitting](fitting.md)."""


def tables() -> str:
    """Return the tables as Markdown text."""
    found = all_compared()
    peers = list(lines({each.recording.name: each for each in found}))
    return "\n\n".join([*_summary(found), *_verdicts(found), *_peers(peers), *_worse(found, peers), *_details(found)])


def page(made_on: str) -> str:
    """Return the page, with the date and the versions that it was made with."""
    return f"{HEAD}\n\n{tables()}\n\n## Made with\n\n`python -m studies.real.write` on {made_on}: {_versions()}\n"


def _versions() -> str:
    parts = [f"Python {platform.python_version()}", *(f"{name} {_version(name)}" for name in DISTRIBUTIONS)]
    return ", ".join(parts) + "."


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "(not installed)"


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (header, ["---"] * len(header), *rows))


def _summary(found: Sequence[Compared]) -> Iterator[str]:
    yield "## Agreement"
    header = (
        "recording",
        "what it is",
        "coefficients that agree",
        "furthest",
        "errors, beside the independent analysis",
    )
    rows = []
    for each in found:
        coefficients = [row for row in each.rows if not row.is_error]
        agree = sum(row.agreement == "yes" for row in coefficients)
        errors = [f"{row.quantity}: {row.agreement}" for row in each.rows if row.is_error]
        furthest = each.furthest
        rows.append((
            each.recording.name, each.recording.what, f"{agree} of {len(coefficients)}",
            f"{furthest.quantity}: {furthest.difference:.2f} u", "; ".join(errors) or "none stated",
        ))  # fmt: skip
    yield markdown(header, rows)


def _verdicts(found: Sequence[Compared]) -> Iterator[str]:
    yield "## What labctl says"
    header = ("recording", "before, deg/s", "after", "held out", "floor", "verdict")
    keys = ("raw_rms_dps", "rms_dps", "heldout_rms_dps", "noise_floor_dps")
    yield markdown(header, [
        (each.recording.name, *(_short(each.answer.error.get(key)) for key in keys), each.answer.verdict)
        for each in found
    ])  # fmt: skip


def _short(value: object) -> str:
    return "not possible" if not isinstance(value, float) else f"{value:.3g}"


def _peers(peers: Sequence[Peer]) -> Iterator[str]:
    yield "## Peers on the same data"
    yield THERMAL
    header = ("recording", "quantity", "peer", "the peer's", "labctl's", "so")
    yield markdown(header, [(p.data, p.quantity, p.peer, p.theirs, p.labctl, p.says) for p in peers])


def _worse(found: Sequence[Compared], peers: Sequence[Peer]) -> Iterator[str]:
    yield "## Where labctl is worse, or disagrees"
    lines = [
        f"- {each.recording.name}, {row.quantity}: {figures(row.labctl)} beside {figures(row.independent)}"
        + (f" ({row.difference:.1f} u)." if row.agreement == "no" else ": labctl worse.")
        for each in found
        for row in each.rows
        if row.agreement in {"no", "labctl worse"}
    ]
    lines += [f"- {p.data}, {p.quantity}: {p.labctl} beside {p.theirs} ({p.peer})." for p in peers if "worse" in p.says]
    yield "\n".join([*lines, NOTES])


def _details(found: Sequence[Compared]) -> Iterator[str]:
    yield "## Quantity by quantity"
    for each in found:
        yield f"### {each.recording.name}"
        yield markdown(("quantity", "labctl", "independent", "difference, u", "agreement"), [
            (
                row.quantity, figures(row.labctl), figures(row.independent),
                "" if row.is_error else f"{row.difference:.2f}", row.agreement,
            )
            for row in each.rows
        ])  # fmt: skip
