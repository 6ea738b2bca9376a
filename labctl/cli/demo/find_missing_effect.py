"""(d) What is missing? An effect hidden in a simulated gyro, then the real gyro: criticise, improve, see it fall.

The schedule of the simulated gyro cannot tell which of two effects is missing: experiments on its bench can.
"""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass

from instruments.clock import VirtualClock
from labctl.answers.calibrations import ImproveRequest
from labctl.answers.criticism import CriticismResponse
from labctl.answers.diagnosis import DiagnosisRequest, DiagnosisResponse
from labctl.cli.demo.runner import DemoRunner
from labctl.cli.printing.criticism import ladder_lines
from labctl.services.calibrations.revision import improve_unit
from labctl.services.campaigns.preparation import clock_for, on_date
from labctl.services.criticism.criticise import criticise_unit
from labctl.services.criticism.ladder import ladder
from labctl.services.diagnosis import begin
from labctl.services.diagnosis.advance import DiagnosisRunner, ExperimentStart
from labctl.services.diagnosis.answer import diagnosis_answer
from labctl.services.diagnosis.experiment_bench import simulated_day
from labctl.store import CampaignRow

SERIAL = "FOG-0002"
HIDDEN = {"saturation": -0.001}
#: Largest time of the experiments on the bench, h.
HOURS = 6.0


def play(demo: DemoRunner, real_serial: str) -> None:
    """Show it on both gyros; every sentence about a gyro comes from its criticism alone."""
    simulated_gyro(demo)
    real_gyro(demo, real_serial)


def simulated_gyro(demo: DemoRunner) -> None:
    """Hide an effect, and have experiments find it."""
    demo.title("(d) Which effect is missing? A gyro with a hidden effect")
    campaign = demo.campaign("ojeda2000-121", "single-axis-sim", hidden=HIDDEN, serial=SERIAL)
    demo.fit(SERIAL, "ojeda2000", campaign.recordings[SERIAL])
    before = criticise_unit(demo.store, SERIAL, None, None, [])
    diagnosis = _diagnose(demo)
    named = list(diagnosis.rounds[-1].named)
    after = _improve(demo, SERIAL, named[0], diagnosis.rounds[-1].recordings)
    demo.say(f"(hidden effect: {', '.join(HIDDEN)})")
    demo.figures["hidden"] = {
        "hidden": list(HIDDEN), "verdict": before.verdict, "named_at_first": [*before.named], "named": [*named],
        "experiments": sum(each.came == "measured" for each in diagnosis.rounds), "hours": diagnosis.spent_hours,
        "verdict_after": after.verdict,
    }  # fmt: skip


def real_gyro(demo: DemoRunner, real_serial: str) -> None:
    """Begin with a simple model of the real gyro, and add what its criticism names first."""
    demo.title("The real gyro's recording, criticised in the same way from a simple model on")
    demo.fit(real_serial, "bias_scale", demo.store.recordings.of_unit(real_serial)[0].id)
    answer = criticise_unit(demo.store, real_serial, None, None, [])
    for sentence in answer.text:
        demo.say(sentence)
    if answer.verdict == "ambiguous":
        demo.say(
            "adding the first suspected effect, to see how much of the error it explains (this does not prove that "
            f"it is the cause): {answer.named[0]}"
        )
    _improve(demo, real_serial, answer.named[0], [])
    for line in ladder_lines(ladder(demo.store, real_serial)):
        demo.say(line)
    demo.figures["real_walk"] = {"named": [*answer.named], "verdict": answer.verdict}


def _diagnose(demo: DemoRunner) -> DiagnosisResponse:
    """Run experiments until one cause is left, as `labctl diagnose` does; returns the diagnosis."""
    store, clock = demo.store, VirtualClock()
    begun = begin.begin(store, SERIAL, DiagnosisRequest(hours=HOURS), None, clock.utc())
    runner = DiagnosisRunner(lambda: nullcontext(store), _DemoLaboratory(demo), clock.utc)
    rounds = 0
    answer = diagnosis_answer(store, begun.id)
    while not answer.ended and runner.advance(begun.id):
        answer = diagnosis_answer(store, begun.id)
        for each in answer.rounds[rounds:]:
            text = f"{each.verdict}: {', '.join(each.named)}" if each.named else each.verdict
            demo.say(f"after {each.spent_hours:.1f} h of experiments: {text}")
            if each.experiment is not None:
                demo.say(f"  next: {each.why}")
        rounds = len(answer.rounds)
    demo.say(answer.why)
    return answer


def _improve(demo: DemoRunner, serial: str, effect: str, recordings: list[int]) -> CriticismResponse:
    """Add an effect, say what it removes, and return what is then said of the version."""
    change = ImproveRequest(add=[effect], recordings=recordings if len(recordings) > 1 else [])
    better = improve_unit(demo.store, serial, change, VirtualClock().utc())
    old, new = better.before, better.error
    demo.say(
        f"added {effect}: RMS {old.rms_dps:.4f} -> {new.rms_dps:.4f} deg/s, held-out temperatures "
        f"{_figure(old.heldout_rms_dps)} -> {_figure(new.heldout_rms_dps)}, noise floor {_figure(new.noise_floor_dps)}"
    )
    after = criticise_unit(demo.store, serial, None, None, [])
    demo.say(f"and then: {after.text[0]}")
    return after


def _figure(value: float | None) -> str:
    return "–" if value is None else f"{value:.4f}"


@dataclass(frozen=True)
class _DemoLaboratory:
    """Criticises in the demo's database, and measures on its simulated bench."""

    demo: DemoRunner

    def criticise(self, serial: str, version: int, recordings: list[int]) -> CriticismResponse:
        return criticise_unit(self.demo.store, serial, version, None, recordings=recordings)

    def start(self, experiment: ExperimentStart) -> None:
        day = simulated_day(self.demo.store, experiment.bench)
        bench = on_date(experiment.bench, day)
        self.demo.run(experiment.recipe, bench, clock_for(bench, None, day))

    def go_on(self, campaign: CampaignRow, *, resumed: bool) -> bool:
        del campaign, resumed  # every campaign of the demo runs to its end
        return True
