"""A diagnosis as text: each round as it comes, and the end."""

from __future__ import annotations

from typing import TYPE_CHECKING

from labctl.cli.output import console, format_number, print_heading, table
from labctl.probability_text import MIN_STATED, probability_text

if TYPE_CHECKING:
    from labctl.answers.diagnosis import DiagnosisResponse, DiagnosisRound

#: Suspects that are shown in the line of a round, at most; those below `MIN_STATED` only in the table.
MAX_SHOWN = 4
#: Columns of the table: the suspects that were most probable in any round.
MAX_COLUMNS = 6


class DiagnosisPrinter:
    """Prints what has come since the last call."""

    def __init__(self, *, quiet: bool) -> None:
        """`quiet`: print nothing."""
        self.quiet = quiet
        self._judged = 0
        self._over = 0
        self._began = False

    def update(self, answer: DiagnosisResponse) -> None:
        """Print the rounds, and the results of experiments, that are new."""
        if self.quiet:
            return
        if not self._began:
            self._began = True
            console.print(_began(answer), soft_wrap=True)
        for each in answer.rounds:
            if each.number > self._judged:
                self._judged = each.number
                _print_round(each)
            if each.came == "cannot_be_done" and each.number > self._over:
                console.print(f"  {each.came_text}", style="yellow", soft_wrap=True)
                self._over = each.number
            elif each.came == "measured" and each.number > self._over and each.number < len(answer.rounds):
                self._over = each.number


def _began(answer: DiagnosisResponse) -> str:
    of = ", ".join(map(str, answer.recordings))
    begins = f", no experiment before {answer.begins_at:%Y-%m-%d %H:%M %Z}" if answer.begins_at else ""
    return (
        f"diagnosis {answer.id} of {answer.serial} version {answer.version} on bench {answer.bench}: recording {of}, "
        f"at most {answer.hours:g} h{begins}"
    )


def _print_round(each: DiagnosisRound) -> None:
    shown = [(effect, p) for effect, p in each.suspects.items() if p >= MIN_STATED][:MAX_SHOWN]
    suspects = ", ".join(f"{effect} {probability_text(p)}" for effect, p in shown)
    of = ", ".join(map(str, each.recordings))
    figures = (
        f"residual {format_number(each.rms_dps)} deg/s RMS, held-out {format_number(each.heldout_rms_dps)}, noise "
        f"floor {format_number(each.noise_floor_dps)}"
    )
    verdict = verdict_text(each)
    console.print(f"round {each.number}, {each.spent_hours:.1f} h: {verdict}", end="", style="bold", soft_wrap=True)
    console.print(f" ({suspects})" if suspects else "", soft_wrap=True)
    console.print(f"  recordings {of}: {figures}", style="dim", soft_wrap=True)
    if each.experiment is not None:
        console.print(f"  next: {each.why}", soft_wrap=True)


def print_diagnosis_end(answer: DiagnosisResponse) -> None:
    """Print the probability of each suspect against bench hours, what came of each experiment, and the end."""
    measured = [each for each in answer.rounds if each.came is not None]
    if measured:
        _print_course(answer)
        print_heading("experiments")
        for each in measured:
            console.print(f"  round {each.number}: {each.came_text}", soft_wrap=True)
    if answer.why:
        console.print(answer.why, style="bold", soft_wrap=True)
    if answer.next:
        console.print(f"next: {answer.next}", style="dim", soft_wrap=True)


def _print_course(answer: DiagnosisResponse) -> None:
    highest = {effect: 1.0 for each in answer.rounds for effect in each.named}
    for each in answer.rounds:
        for effect, probability in each.suspects.items():
            highest[effect] = max(probability, highest.get(effect, 0.0))
    columns = sorted(highest, key=lambda effect: -highest[effect])[:MAX_COLUMNS]
    rows = table("probability of each suspect; –: not listed", "bench h", "verdict", *columns)
    for each in answer.rounds:
        values = [_listed(each, effect) for effect in columns]
        rows.add_row(f"{each.spent_hours:.1f}", verdict_text(each), *values)
    console.print(rows)


def _listed(each: DiagnosisRound, effect: str) -> str:
    probability = each.suspects.get(effect)
    return "–" if probability is None else probability_text(probability)


def verdict_text(each: DiagnosisRound) -> str:
    """Return a verdict with the effects that it is based on."""
    return f"{each.verdict}: {', '.join(each.named)}" if each.named else each.verdict
