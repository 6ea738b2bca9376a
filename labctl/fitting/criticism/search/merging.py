"""One verdict of several axes, each searched by itself."""

from __future__ import annotations

from collections.abc import Mapping

from labctl.fitting.criticism.verdict import Verdict


def merged(apart: Mapping[str, Verdict], joint: Verdict) -> Verdict:
    """Return the verdict of the axes, each with causes of its own; the joint one where an axis stays unexplained."""
    if any(verdict.form == "unexplained" for verdict in apart.values()):
        return joint
    axes: dict[tuple[str, ...], tuple[str, ...]] = {}
    for axis, verdict in apart.items():
        for group in verdict.groups:
            same = next((known for known in axes if known[0] == group[0]), group)
            axes[same] = (*axes.get(same, ()), axis)
    if not axes:
        return joint
    terms = {name: term for verdict in apart.values() for name, term in verdict.terms.items()}
    remainders = [verdict.remainder for verdict in apart.values() if verdict.remainder is not None]
    return Verdict(
        "missing" if all(len(group) == 1 for group in axes) else "ambiguous", tuple(axes), joint.depends_on,
        terms={group[0]: terms[group[0]] for group in axes if group[0] in terms},
        remainder=max(remainders, key=lambda each: float(each["share"]), default=None),
        axes={group[0]: where for group, where in axes.items()},
    )  # fmt: skip
