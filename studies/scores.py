"""Scores of one answer of the criticism study: whether what is hidden was named, alone, in a group, or not."""

from __future__ import annotations

from typing import Any

from labctl.fitting.effects import CATALOGUE
from studies.campaigns import OUTSIDE

Answer = dict[str, Any]
#: Two effects are the same on a schedule when one reproduces more than this share of the other's signal.
SAME = 0.999


def truth(answer: Answer) -> str:
    """Return the one effect that is hidden."""
    return str(next(iter(answer["hidden"])))


def names(effect: str) -> set[str]:
    """Return an effect with those that have the same columns on every schedule."""
    return {effect, *CATALOGUE[effect].aliases} if effect in CATALOGUE else {effect}


def right_or_group(answer: Answer) -> bool:
    """Return whether what is hidden was named, alone or in a group that cannot be distinguished."""
    return truth(answer) in answer["named"]


def single(answer: Answer) -> bool:
    """Return whether one thing was named: by one name, or by several of which the catalogue says that they are one."""
    return bool(answer["named"]) and (answer["nodes"] == 1 or set(answer["named"]) <= names(answer["named"][0]))


def right_first(answer: Answer) -> bool:
    """Return whether what is hidden, or its exact alias, was named first, which is how the other tools are counted."""
    return bool(answer["named"]) and answer["named"][0] in names(truth(answer))


def wrong_first(answer: Answer) -> bool:
    """Return whether something else was named first, also where that is a group."""
    return bool(answer["named"]) and not right_first(answer)


def right_alone(answer: Answer) -> bool:
    """Return whether what is hidden was named, and nothing else but its exact aliases."""
    return right_or_group(answer) and single(answer)


def right_cause(answer: Answer) -> bool:
    """Return whether what is hidden was named, and nothing that this schedule does not make the same."""
    return right_or_group(answer) and (single(answer) or answer["alike"] > SAME)


def wrong_claim(answer: Answer) -> bool:
    """Return whether something was named, and what is hidden was not among it."""
    return bool(answer["named"]) and not right_or_group(answer)


def wrong_single(answer: Answer) -> bool:
    """Return whether one thing was named, and it was another."""
    return single(answer) and not right_or_group(answer)


def one_too_many(answer: Answer) -> bool:
    """Return whether another effect was called missing beside the hidden one, that is not its exact alias."""
    return answer["verdict"] == "missing" and not set(answer["named"]) <= names(truth(answer))


def alarm(answer: Answer) -> bool:
    """Return whether anything was said to be missing where nothing is."""
    return bool(answer["verdict"] not in {"adequate", "insufficient_data"})


class Said:
    """How a tool's answer counts: what it names first is what it claims."""

    def __init__(self, tool: str) -> None:
        self.tool = tool

    def named(self, answer: Answer) -> list[str]:
        """Return everything that the tool names, first things first."""
        return list(answer["peers"][self.tool]["named"])

    def alarm(self, answer: Answer) -> bool:
        """Return whether it names anything."""
        return bool(self.named(answer))

    def right(self, answer: Answer) -> bool:
        """Return whether it names the hidden effect, or its exact alias, first."""
        return self.alarm(answer) and self.named(answer)[0] in names(truth(answer))

    def wrong(self, answer: Answer) -> bool:
        """Return whether it names another effect first."""
        return self.alarm(answer) and not self.right(answer)

    def among(self, answer: Answer) -> bool:
        """Return whether the hidden effect is anywhere among those it names."""
        return bool(names(truth(answer)) & set(self.named(answer)))


def right_channel(answer: Answer) -> bool:
    """Return whether an effect outside the catalogue is said to be so, with the channel it depends on first."""
    return answer["verdict"] == "unexplained" and answer["depends_on"][:1] == [OUTSIDE[truth(answer)]]


def says_large_drift(answer: Answer) -> bool:
    """Return whether labctl says that the drift is larger than specified."""
    return bool(answer.get("large_drift"))


def both_named(answer: Answer) -> bool:
    """Return whether both hidden effects are named: each, its exact alias, or in a group."""
    return all(names(effect) & set(answer["named"]) for effect in answer["hidden"])


def both_alone(answer: Answer) -> bool:
    """Return whether both hidden effects are named, and neither in a group."""
    return both_named(answer) and answer["verdict"] == "missing"


def another_named(answer: Answer) -> bool:
    """Return whether something is named that is not hidden."""
    return not set(answer["named"]) <= set().union(*(names(effect) for effect in answer["hidden"]))
