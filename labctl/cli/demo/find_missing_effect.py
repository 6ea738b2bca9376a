"""(e) What is missing? An effect hidden in a simulated gyro, then the real gyro: criticise, improve, see it fall."""

from __future__ import annotations

from instruments.clock import VirtualClock
from labctl.answers.calibrations import ImproveRequest
from labctl.answers.criticism import CriticismResponse
from labctl.cli.demo.runner import DemoRunner
from labctl.cli.printing.criticism import ladder_lines
from labctl.services.calibrations.revision import improve_unit
from labctl.services.criticism.criticise import criticise_unit
from labctl.services.criticism.ladder import ladder

SERIAL = "FOG-0002"
HIDDEN = {"scale_factor_asymmetry": 2e-4}


def play(demo: DemoRunner, real_serial: str) -> None:
    """Show it on both gyros; every sentence about a gyro comes from its criticism alone."""
    demo.title("(e) Which effect is missing? A gyro with a hidden effect")
    campaign = demo.campaign("ojeda2000-121", "single-axis-sim", hidden=HIDDEN, serial=SERIAL)
    demo.fit(SERIAL, "ojeda2000", campaign.recordings[SERIAL])
    answer = _criticise_and_improve(demo, SERIAL)
    demo.say(f"(hidden effect: {', '.join(HIDDEN)})")
    demo.figures["hidden"] = {"hidden": list(HIDDEN), "named": [*answer.named], "verdict": answer.verdict}
    demo.title("The real gyro's recording, criticised in the same way from a simple model on")
    demo.fit(real_serial, "bias_scale", demo.store.recordings.of_unit(real_serial)[0].id)
    answer = _criticise_and_improve(demo, real_serial)
    demo.figures["real_walk"] = {"named": [*answer.named], "verdict": answer.verdict}


def _criticise_and_improve(demo: DemoRunner, serial: str) -> CriticismResponse:
    answer = criticise_unit(demo.store, serial, None, None, [])
    for sentence in answer.text:
        demo.say(sentence)
    if answer.named:
        added = answer.named[0]
        better = improve_unit(demo.store, serial, ImproveRequest(add=[added]), VirtualClock().utc())
        before, after = better.before, better.error
        if answer.verdict == "ambiguous":
            demo.say(
                "adding the first suspected effect, to see how much of the error it explains (this does not "
                f"prove that it is the cause): {added}"
            )
        demo.say(
            f"added {added}: RMS {before.rms_dps:.4f} -> {after.rms_dps:.4f} deg/s, held-out temperatures "
            f"{before.heldout_rms_dps:.4f} -> {after.heldout_rms_dps:.4f}, noise floor {after.noise_floor_dps:.4f}"
        )
        demo.say(f"and then: {criticise_unit(demo.store, serial, None, None, []).text[0]}")
    for line in ladder_lines(ladder(demo.store, serial)):
        demo.say(line)
    return answer
