"""What a diagnosis says of its choices, its results and its end."""

from __future__ import annotations

from collections.abc import Sequence

from labctl.answers.criticism import Experiment
from labctl.answers.diagnosis import ChosenExperiment
from labctl.probability_text import probability_text


def choice(experiment: Experiment) -> str:
    """Return why an experiment is chosen."""
    return f"{experiment['do']}: {experiment['why']}"


def expected(experiment: ChosenExperiment) -> str:
    """Return what is expected of an experiment."""
    return (
        f"expected: one cause named alone with a probability of {probability_text(experiment.power)}, in "
        f"{hours(experiment.hours)}"
    )


def measured(took_hours: float, campaign: int) -> str:
    """Return that an experiment was measured."""
    return f"measured in {hours(took_hours)} by campaign {campaign}"


def not_done(reason: str) -> str:
    """Return that an experiment cannot be done."""
    return f"cannot be done: {reason}; it is not proposed again"


def not_judged(recording: int, reason: str) -> str:
    """Return that the recording of an experiment cannot be judged with the others."""
    return f"recording {recording} cannot be judged with the others, and is left out: {reason}"


def adequate(spent_hours: float, doubtful: Sequence[str] = ()) -> str:
    """Return that nothing is missing, and for which effects there is some evidence, not enough to name one."""
    but = f"; there is some evidence for {_either(doubtful)}, too little to name one of them" if doubtful else ""
    return f"The model is adequate: noise explains the residual of all recordings together{_after(spent_hours)}{but}."


def found(named: Sequence[str], spent_hours: float) -> str:
    """Return what is missing."""
    what = f"One cause is left: {named[0]}" if len(named) == 1 else f"Missing together: {', '.join(named)}"
    return f"{what}{_after(spent_hours)}."


def unexplained(depends_on: Sequence[str]) -> str:
    """Return that the catalogue has no effect for the residual."""
    channels = f", which depends on {', '.join(depends_on)}" if depends_on else ""
    return f"No effect of the catalogue explains the residual{channels}."


def insufficient(text: Sequence[str]) -> str:
    """Return that there is too little for a verdict."""
    return f"Too little was measured for a verdict. {text[0] if text else ''}".strip()


def none_offered(named: Sequence[str]) -> str:
    """Return that no experiment distinguishes what is left."""
    return f"No experiment on this bench distinguishes {_either(named)}."


def all_were_run(named: Sequence[str], experiments: int) -> str:
    """Return that all experiments were measured and did not distinguish what is left."""
    how_many = "The only experiment was" if experiments == 1 else f"Each of the {experiments} experiments was"
    return f"{how_many} measured and does not distinguish {_either(named)}."


def none_can_be_done(named: Sequence[str], experiments: int) -> str:
    """Return that no experiment can be done."""
    how_many = "The only experiment" if experiments == 1 else f"Each of the {experiments} experiments"
    return f"{how_many} that would distinguish {_either(named)} cannot be done."


def hours_spent(named: Sequence[str], of_hours: float, left_hours: float, shortest_hours: float) -> str:
    """Return that the hours are spent."""
    return (
        f"{hours(left_hours)} of {hours(of_hours)} are left, and the shortest experiment that may distinguish "
        f"{_either(named)} takes {hours(shortest_hours)}; give more with --hours"
    )


def hours(value: float) -> str:
    """Write hours with their unit."""
    return f"{value:.1f} h"


def _either(named: Sequence[str]) -> str:
    return " and ".join([", ".join(named[:-1]), named[-1]] if len(named) > 1 else named)


def _after(spent_hours: float) -> str:
    return f", after {hours(spent_hours)} on the bench" if spent_hours else ""
