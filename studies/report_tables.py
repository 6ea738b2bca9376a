"""The arithmetic and the Markdown of the criticism study: shares with 95 % intervals, by method and by size."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from studies.campaigns import PROTOCOLS
from studies.scores import (
    Answer,
    Said,
    alarm,
    another_named,
    both_alone,
    both_named,
    one_too_many,
    right_alone,
    right_cause,
    right_channel,
    right_first,
    right_or_group,
    says_large_drift,
    wrong_claim,
    wrong_first,
    wrong_single,
)

Z95 = 1.959963984540054


def wilson(hits: float, n: int) -> tuple[float, float]:
    """Return the 95 % interval (Wilson) of a share of which `hits` of `n` were seen."""
    if n == 0:
        return 0.0, 1.0
    share, z2 = hits / n, Z95**2
    middle = (share + z2 / (2 * n)) / (1 + z2 / n)
    half = Z95 * np.sqrt(share * (1 - share) / n + z2 / (4 * n * n)) / (1 + z2 / n)
    return max(float(middle - half), 0.0), min(float(middle + half), 1.0)


def share(values: Iterable[bool]) -> str:
    """Return a share in per cent with its interval, as `98.5 (97.2 to 99.2)`."""
    seen = [bool(value) for value in values]
    if not seen:
        return "-"
    low, high = wilson(sum(seen), len(seen))
    return f"{100 * sum(seen) / len(seen):.3g} ({100 * low:.1f} to {100 * high:.1f})"


def markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


class Cells:
    """The answers of a study by kind and size."""

    def __init__(self, answers: Sequence[Answer]) -> None:
        self.answers = answers
        self.z_levels = sorted({float(a["z"]) for a in answers if a["kind"] == "effect"})

    def of(self, kind: str, z: float | None = None, protocol: str | None = None) -> list[Answer]:
        """Return the answers of a cell."""
        return [
            a for a in self.answers
            if a["kind"] == kind and z in (None, a["z"]) and protocol in (None, a["protocol"])
        ]  # fmt: skip

    def each_z(self, kind: str, count: Callable[[Answer], bool], protocol: str | None = None) -> list[str]:
        """Return a share at every size."""
        return [share(map(count, self.of(kind, z, protocol))) for z in self.z_levels]

    @property
    def tools(self) -> list[str]:
        """The other tools that were asked."""
        return list(dict.fromkeys(tool for a in self.answers for tool in a.get("peers", {})))


def comparison(cells: Cells) -> str:
    """Return labctl beside the other tools: false alarms, right names and wrong claims."""
    null = cells.of("nothing")
    rows = [
        [f"**labctl**, {what}", share(map(alarm, null)), *cells.each_z("effect", right),
         *cells.each_z("effect", wrong)]
        for what, right, wrong in (
            ("name or group", right_or_group, wrong_claim),
            ("what it names first", right_first, wrong_first),
            ("name alone", right_alone, wrong_single),
        )
    ]  # fmt: skip
    for said in map(Said, cells.tools):
        asked = Cells([a for a in cells.answers if "peers" in a])
        rows.append(
            [said.tool, share(map(said.alarm, asked.of("nothing"))), *asked.each_z("effect", said.right),
             *asked.each_z("effect", said.wrong)]
        )  # fmt: skip
    head = ["method", "false alarm %"]
    head += [f"{what} %, z = {z:g}" for what in ("right name", "wrong claim") for z in cells.z_levels]
    return markdown(head, rows)


def in_full(cells: Cells) -> str:
    """Return what the other tools name in all, where nothing is hidden, and whether the truth is among it."""
    asked = Cells([a for a in cells.answers if "peers" in a])
    rows = []
    for said in map(Said, cells.tools):
        number = np.mean([len(said.named(a)) for a in asked.of("nothing")])
        falsely = share(map(said.alarm, asked.of("outside")))
        rows.append([said.tool, f"{number:.1f}", *asked.each_z("effect", said.among), falsely])
    head = ["method", "effects named with nothing hidden", *(f"truth among them %, z = {z:g}" for z in cells.z_levels)]
    return markdown([*head, "names an effect for one outside the catalogue %"], rows)


def own(cells: Cells) -> str:
    """Return labctl's own rates, by protocol and pooled."""
    counts: tuple[tuple[str, Callable[[Answer], bool]], ...] = (
        ("right name or group", right_or_group),
        ("right name alone", right_alone),
        ("right name alone, or with what the schedule makes the same", right_cause),
        ("wrong single name", wrong_single),
        ("named, truth not among it", wrong_claim),
        ("a name too many", one_too_many),
    )
    places: tuple[str | None, ...] = (*PROTOCOLS, None)
    rows = [[what, place or "all", *cells.each_z("effect", count, place)] for what, count in counts for place in places]
    outside = (("outside: unexplained, right channel first", right_channel), ("outside: an effect named", _names))
    rows += [
        [what, place or "all", *cells.each_z("outside", count, place)] for what, count in outside for place in places
    ]
    return markdown(["%", "protocol", *(f"z = {z:g}" for z in cells.z_levels)], rows)


def _names(answer: Answer) -> bool:
    return bool(answer["named"])


def extras(cells: Cells) -> str:
    """Return the rates of the other cells, by protocol and pooled."""
    places: tuple[str | None, ...] = (*PROTOCOLS, None)
    counts: tuple[tuple[str, str, Callable[[Answer], bool]], ...] = (
        ("false alarm, nothing hidden", "nothing", alarm),
        ("false alarm, 1 % outliers and 3 % of data sets missing", "spoiled", alarm),
        ("false alarm, drift three times its size", "drifting", alarm),
        ("the same: drift said to be larger than specified", "drifting", says_large_drift),
        ("two effects, z = 20: both named, alone or in a group", "two", both_named),
        ("the same: each by one name", "two", both_alone),
        ("the same: another one named", "two", another_named),
    )
    rows = [[what, *(share(map(count, cells.of(kind, protocol=place))) for place in places)]
            for what, kind, count in counts]  # fmt: skip
    rows.append(["held-out RMS over floor once improved, z = 30: median (90 %)",
                 *(_spread(cells.answers, place) for place in places)])  # fmt: skip
    return markdown(["%", *(place or "all" for place in places)], rows)


def _spread(answers: Sequence[Answer], protocol: str | None) -> str:
    asked = [a for a in answers if "held_out" in a and protocol in (None, a["protocol"])]
    values = [a["held_out"] for a in asked if a["held_out"] is not None]
    if not values:
        return "-"
    unfit = f", {len(asked) - len(values)} could not be fitted" if len(values) < len(asked) else ""
    return f"{np.median(values):.3g} ({np.quantile(values, 0.9):.3g}){unfit}"


def costs(answers: Sequence[Answer]) -> str:
    """Return what a campaign took, by protocol, s of one core."""
    parts = list(dict.fromkeys(part for a in answers for part in a["seconds"]))
    tools = list(dict.fromkeys(tool for a in answers for tool in a.get("peers", {})))

    def mean(values: list[float]) -> str:
        return f"{np.mean(values):.2f}" if values else "-"

    rows = [[part, *(mean([a["seconds"][part] for a in answers if a["protocol"] == p and part in a["seconds"]])
                     for p in PROTOCOLS)] for part in parts]  # fmt: skip
    rows += [[tool, *(mean([a["peers"][tool]["seconds"] for a in answers if a["protocol"] == p and "peers" in a])
                      for p in PROTOCOLS)] for tool in tools]  # fmt: skip
    return markdown(["s per campaign", *PROTOCOLS], rows)


def report(answers: Sequence[Answer], versions: dict[str, str]) -> str:
    """Return everything, for docs/explanation/criticism.md."""
    cells = Cells(answers)
    counted = ", ".join(f"{len(cells.of(kind))} {kind}" for kind in dict.fromkeys(a["kind"] for a in answers))
    parts = [f"Campaigns: {counted}. Shares in per cent with 95 % intervals (Wilson)."]
    if versions:
        parts.append("With " + ", ".join(f"{name} {number}" for name, number in versions.items()) + ".")
    parts.append(comparison(cells))
    if cells.tools:
        parts.append(in_full(cells))
    return "\n\n".join([*parts, own(cells), extras(cells), costs(answers)])
