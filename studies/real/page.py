"""The page of real gyros: tables of quantities, verdicts and peers as Markdown."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Iterator, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from studies.real.comparison import Compared, all_compared, figures
from studies.real.peers import Peer, lines

PAGE = Path(__file__).resolve().parents[2] / "docs" / "explanation" / "real-gyros.md"
#: Packages on whose versions the tables depend.
DISTRIBUTIONS = ("numpy", "scipy", "imucal", "allantools")
HEAD = """\
# Real gyros

This page shows how good the results of labctl are on real data. labctl fits and criticises every public recording
of a real gyro that it may include, and an independent analysis computes the same quantities. `python -m studies
real` prints the tables; `python -m studies.real.write` writes this page. The recordings are in
`examples/published`; README.md there names the authors and licences. labctl was used by its commands, as in [from
a file to a calibration](../how-to/from-a-file-to-a-calibration.md). The independent analyses
(`studies/real/independent`) import only numpy and scipy and have formulas of their own.

Values are value +- U (k = 2); where U is missing, the analysis does not state it. *Difference* is labctl's value
minus that of the independent analysis, divided by labctl's standard uncertainty u. Both analyses use the same
readings, so an error of the readings is not visible in the difference. *Agreement* is *yes* if the difference is
at most 2 u; for error figures it is *same* if the two differ by at most 5 %."""
NOTES = """\
- The choice of the quiet sections that count as rests changes elements of the matrix. Neither labctl's uncertainty
  nor that of the independent analysis includes the effect of this choice. If the independent analysis of
  mpu9150-2 uses the rests that labctl finds, it gives 7.5 +- 1.6 for the element that disagrees (labctl 7.9 +- 2.4,
  published 8.4). If one more rest of 1.7 s is used, an element of the matrix of mpu9150-1
  changes by 2e-3.
- At rest labctl's U is 1.5 to 6 times that of the independent analysis. labctl treats slow variations of the
  output as drift that lasts for minutes; the independent analysis assumes that sections of 2 min, or bursts, are
  independent. These data cannot show which assumption is right.
- Where the autopilots' cubic has less error than labctl's parabola, the bias differs from a parabola by less than
  the criticism considers significant: `labctl fit PAN-2020 --effects bias,bias_temperature:3` gives a held-out
  error of 0.0069 deg/s in place of 0.0073 deg/s.
- A recording of poses (the unit is held still in one position after another, without a rate table) cannot be
  criticised, because the rates during the moves are not known. For recordings with one turn about each axis neither a
  criticism nor a held-out error is possible."""
THERMAL = """\
The formulas of the autopilots PX4 and ArduPilot fit cubics in temperature to the samples (the results agree with
those of the programs' own functions to 1e-11 deg/s). Each eighth of the temperature range is left out in turn. The
error is that of means over 17 s, or of bursts, the same for all methods. The coldest eighth of the warm-up spans
11 K, and a cubic that was fitted without it extrapolates badly. [Fitting](fitting.md) has results for simulated
temperature loops with a lag or a hysteresis."""


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
        f"- {each.recording.name}, {row.quantity}: {figures(row.labctl)} by labctl, {figures(row.independent)} by the "
        "independent analysis"
        + (f" (difference {row.difference:.1f} u)." if row.agreement == "no" else ": labctl is worse.")
        for each in found
        for row in each.rows
        if row.agreement in {"no", "labctl worse"}
    ]
    lines += [
        f"- {p.data}, {p.quantity}: {p.labctl} by labctl, {p.theirs} by {p.peer}." for p in peers if "worse" in p.says
    ]
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
