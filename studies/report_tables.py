"""The arithmetic and the Markdown of the criticism study: shares with 95 % intervals, by method and by size."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from labctl.fitting.criticism.criticism import LARGE_DRIFT
from labctl.fitting.effects import CATALOGUE
from studies.campaigns import OUTSIDE, PROTOCOLS

Answer = dict[str, Any]
#: The same on a schedule: one gives all but this of the other's signal.
SAME = 0.999
Z95 = 1.959963984540054


def wilson(hits: int, n: int) -> tuple[float, float]:
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


def truth(answer: Answer) -> str:
    """Return the one effect that is hidden."""
    return str(next(iter(answer["hidden"])))


def names(effect: str) -> set[str]:
    """Return an effect with those that have the same columns on every schedule."""
    return {effect, *CATALOGUE[effect].aliases} if effect in CATALOGUE else {effect}


def right_or_group(answer: Answer) -> bool:
    """Whether what is hidden was named, alone or among those that it cannot be told from."""
    return truth(answer) in answer["named"]


def single(answer: Answer) -> bool:
    """Whether one thing was named: by one name, or by several of which the catalogue says that they are one."""
    return bool(answer["named"]) and (answer["nodes"] == 1 or set(answer["named"]) <= names(answer["named"][0]))


def right_first(answer: Answer) -> bool:
    """Whether what is hidden, or its exact like, is what was named first, as the other tools' claims are counted."""
    return bool(answer["named"]) and answer["named"][0] in names(truth(answer))


def wrong_first(answer: Answer) -> bool:
    """Whether something else was named first, be it in a group that says that it cannot be told."""
    return bool(answer["named"]) and not right_first(answer)


def right_alone(answer: Answer) -> bool:
    """Whether what is hidden was named, and nothing else but its exact likes."""
    return right_or_group(answer) and single(answer)


def right_cause(answer: Answer) -> bool:
    """Whether what is hidden was named, and nothing that this schedule does not make the same."""
    return right_or_group(answer) and (single(answer) or answer["alike"] > SAME)


def wrong_claim(answer: Answer) -> bool:
    """Whether something was named, and what is hidden was not among it."""
    return bool(answer["named"]) and not right_or_group(answer)


def wrong_single(answer: Answer) -> bool:
    """Whether one thing was named, and it was another."""
    return single(answer) and not right_or_group(answer)


def one_too_many(answer: Answer) -> bool:
    """Whether another effect was called missing beside the hidden one, that is not its exact like."""
    return answer["verdict"] == "missing" and not set(answer["named"]) <= names(truth(answer))


def alarm(answer: Answer) -> bool:
    """Whether anything was said to be missing where nothing is."""
    return bool(answer["verdict"] not in {"adequate", "insufficient_data"})


class Said:
    """How a tool's answer counts: what it names first is what it claims."""

    def __init__(self, tool: str) -> None:
        self.tool = tool

    def named(self, answer: Answer) -> list[str]:
        """Return everything that the tool names, first things first."""
        return list(answer["peers"][self.tool]["named"])

    def alarm(self, answer: Answer) -> bool:
        """Whether it names anything."""
        return bool(self.named(answer))

    def right(self, answer: Answer) -> bool:
        """Whether it names the hidden effect, or its exact like, first."""
        return self.alarm(answer) and self.named(answer)[0] in names(truth(answer))

    def wrong(self, answer: Answer) -> bool:
        """Whether it names another effect first."""
        return self.alarm(answer) and not self.right(answer)

    def among(self, answer: Answer) -> bool:
        """Whether the hidden effect is anywhere among those it names."""
        return bool(names(truth(answer)) & set(self.named(answer)))


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


def right_channel(answer: Answer) -> bool:
    """Whether an effect outside the catalogue is said to be so, with what it hangs on first."""
    return answer["verdict"] == "unexplained" and answer["depends_on"][:1] == [OUTSIDE[truth(answer)]]


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


def says_large_drift(answer: Answer) -> bool:
    """Whether labctl says that the drift is larger than specified."""
    return (answer.get("drift") or 0.0) > LARGE_DRIFT


def both_named(answer: Answer) -> bool:
    """Whether both hidden effects are named: each, its exact like, or a group that it cannot be told from."""
    return all(names(effect) & set(answer["named"]) for effect in answer["hidden"])


def both_alone(answer: Answer) -> bool:
    """Whether both hidden effects are named, and neither with others that it could not be told from."""
    return both_named(answer) and answer["verdict"] == "missing"


def another_named(answer: Answer) -> bool:
    """Whether something is named that is not hidden."""
    return not set(answer["named"]) <= set().union(*(names(effect) for effect in answer["hidden"]))


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
