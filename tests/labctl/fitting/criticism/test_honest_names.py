"""What must not be named: the nearest shape of another law, a law of the base in a higher order, an impossible sign."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import pytest

from labctl.fitting.criticism import Verdict
from labctl.fitting.criticism.model_comparison import Comparison, compare_models, design_of
from labctl.fitting.criticism.reduction import reduce_recording
from labctl.fitting.criticism.search import stepwise
from labctl.fitting.criticism.search.discrepancy import discrepancies
from labctl.fitting.criticism.search.remainder import is_better_than_smooth
from labctl.fitting.criticism.search.steps import refined_steps
from labctl.fitting.criticism.verdict import is_at_end, refines_base
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.effects import CATALOGUE, Effect, Term
from labctl.fitting.models.presets import preset_for
from labctl.recording import Recording
from labctl.services.simulation.recordings import SimulateRequest, make_recording
from studies.campaigns import MODELS, campaign
from studies.effect_sizes import sizes
from studies.outside_catalogue import KINDS
from tests.helpers.criticism import held
from tests.helpers.simulated_recordings import single_axis


def plain(recipe: str, seed: int) -> Recording:
    return make_recording(SimulateRequest(recipe=recipe, seed=seed, sample_rate_hz=4.0)).recording


def added(kind: str, recipe: str, model: str, size_dps: float, seed: int = 0) -> Verdict:
    return held(KINDS[kind].added(plain(recipe, seed), seed, size_dps), model).verdict


@pytest.mark.slow
@pytest.mark.parametrize(
    ("recipe", "model", "size_dps", "seed"),
    [("gyrostar", "weiss1995", 0.5, 0), ("ojeda2000", "ojeda2000", 0.03, 1), ("ojeda2000", "ojeda2000", 1.0, 0)],
)
def test_a_scale_factor_that_decays_in_hours_is_no_self_heating(
    recipe: str, model: str, size_dps: float, seed: int
) -> None:
    """Self-heating is over within an hour, and its longest time constant is the nearest it comes to two hours."""
    verdict = added("power_scale", recipe, model, size_dps, seed)
    assert (verdict.form, verdict.named) == ("unexplained", ())
    assert {verdict.depends_on[0], *verdict.confounded} & {"t_s", "power_s"}


def test_an_effect_may_be_at_the_end_of_its_range_and_a_law_in_the_base() -> None:
    recording = KINDS["power_scale"].added(plain("ojeda2000", 0), 0, 0.03)
    model, _ = preset_for("ojeda2000", []).build(fit_data_of(recording))
    compared = compare_models(reduce_recording(recording), model)
    found = {c.id: c for c in compared.candidates if not c.smooth}
    assert is_at_end(compared, found["self_heating"])
    assert refines_base(compared, found["scale_factor_temperature"])
    assert not refines_base(compared, found["self_heating"])
    assert not is_at_end(compared, found["missed_steps"])


@pytest.mark.parametrize("seed", [0, 9])
def test_a_table_is_not_blamed_for_how_steep_the_law_is_at_its_nodes(seed: int) -> None:
    """A tanh of half a deg/s per kelvin, and levels that scatter by hundredths of a kelvin."""
    assert held(plain("gyrostar", seed), "weiss1995").verdict.form == "adequate"


def test_a_wave_in_time_is_no_warm_up() -> None:
    verdict = added("daily_wave", "gyrostar", "weiss1995", 0.5)
    assert (verdict.form, verdict.named, verdict.depends_on[0]) == ("unexplained", (), "t_s")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("recipe", "model", "size_dps"), [("gyrostar", "weiss1995", 0.5), ("ojeda2000", "ojeda2000", 0.03)]
)
def test_a_random_surface_over_rate_and_temperature_is_no_effect(recipe: str, model: str, size_dps: float) -> None:
    """A cubic, and a resonance with a saturation, follow it, and a polynomial over both has far more evidence."""
    verdict = added("field", recipe, model, size_dps, seed=1)
    assert (verdict.form, verdict.named) == ("unexplained", ())
    assert verdict.depends_on[:2] == ("table_rate_dps", "temperature_c")


@pytest.mark.parametrize("z", [100, 1000])
def test_a_saturation_that_bends_softly_is_still_named(z: int) -> None:
    """A polynomial follows a soft bend nearly as well as the knee of the catalogue does."""
    hidden = {"saturation": sizes("O")["saturation"]["100"] * z / 100}
    assert held(campaign("O", 20_013, hidden)).verdict.named[:1] == ("saturation",)


@pytest.mark.slow
def test_a_step_of_the_scale_factor_within_a_data_set_is_time() -> None:
    verdict = added("time_step_scale", "ojeda2000", "ojeda2000", 1.0)
    assert (verdict.form, verdict.named, verdict.depends_on[0]) == ("unexplained", (), "t_s")


@pytest.mark.slow
def test_the_place_of_a_step_is_found_and_nothing_where_there_is_none() -> None:
    recording = KINDS["time_step_bias"].added(plain("ojeda2000", 0), 0, 1.0)
    model, _ = preset_for("ojeda2000", []).build(fit_data_of(recording))
    (name,) = refined_steps(compare_models(reduce_recording(recording), model))["z"].names
    t_s = recording.columns["t_s"]
    assert float(name.removeprefix("t_s>")) == pytest.approx(t_s[0] + 0.6 * (t_s[-1] - t_s[0]), abs=60.0)
    assert not refined_steps(compare_models(reduce_recording(plain("ojeda2000", 0)), model))


@pytest.mark.slow
def test_a_step_in_time_is_no_re_mounting() -> None:
    """Beside a re-mounting of some wrong shape, waves of the Earth's rate, in the base anyway, are no part of it."""
    recording = KINDS["time_step_bias"].added(plain("informative", 0), 0, 0.03)
    model, _ = preset_for("yang2018", []).build(fit_data_of(recording))
    data = reduce_recording(recording)
    compared = compare_models(data, model, designs={"x": design_of(data, model, "x")})
    effect, smooth = compared.leader(smooth=False), compared.leader(smooth=True)
    assert effect is not None
    assert smooth is not None
    assert (effect.id, smooth.id) == ("mounting_shift", "t_s")
    assert not is_better_than_smooth(compared, compared, effect, smooth, discrepancies(compared, effect))


@pytest.mark.slow
def test_a_channel_times_the_rate_is_that_channel_upside_down_too() -> None:
    verdict = added("humidity_scale", "informative", "yang2018", 0.03)
    assert (verdict.form, verdict.named) == ("unexplained", ())
    assert verdict.depends_on[0] == "humidity_pct"


def test_a_dead_band_of_a_quarter_of_the_range_is_named() -> None:
    assert held(single_axis(3, dead_band=20.0)).verdict.named[:1] == ("dead_band",)


def test_a_size_of_a_sign_that_an_effect_cannot_have_is_outside() -> None:
    """An output beyond its saturation, a band in which there is more than the rate."""
    assert CATALOGUE["saturation"].outside("mems", 0.1, 0.01)
    assert not CATALOGUE["saturation"].outside("mems", -0.1, 0.01)
    assert not CATALOGUE["saturation"].outside("mems", 0.01, 0.01)
    assert CATALOGUE["dead_band"].outside("fog", -0.1, 0.01)
    assert not CATALOGUE["g_sensitivity"].outside("mems", -0.05, 0.01)
    assert CATALOGUE["g_sensitivity"].outside("mems", -0.2, 0.01)
    assert CATALOGUE["sine_response"].outside("mems", 0.02, 0.001)
    assert CATALOGUE["sine_response"].outside("no such", 0.02, 0.001) is None


def test_what_grows_beyond_the_rate_is_no_saturation() -> None:
    """The same bend with the other sign: no output of a gyro has it."""
    recording = single_axis(3, saturation=0.02)
    assert recording.info.technology is not None
    unstated = replace(recording, info=recording.info.model_copy(update={"technology": None}))
    for each in (recording, unstated):  # a sign that no technology has is none of an unknown one
        assert "saturation" not in held(each).verdict.named


def hidden(protocol: str, effect: str, z: int, seed: int) -> Verdict:
    size = sizes(protocol)[effect][str(z)]
    return held(campaign(protocol, seed, {effect: size}), MODELS[protocol]).verdict


@pytest.mark.slow
def test_a_table_may_be_out_of_level_without_a_bearing_that_wobbles() -> None:
    """Its one wave per turn is that of the Earth's rate, which was named without it where the second is too small."""
    verdict = hidden("Y", "table_tilt", 5, 20_020)
    assert verdict.groups == (("earth_rate_tilt", "magnetic_sensitivity", "table_tilt"),)


@pytest.mark.slow
def test_an_effect_of_much_less_evidence_does_not_take_the_place_of_one_that_predicts_worse(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Self-heating has 9 nats less evidence here than the warm-up, which is the truth."""
    assert hidden("Y+", "warm_up", 5, 20_024).groups == (("warm_up",),)
    is_worse = stepwise.held_out_rises

    def rises(comparison: Comparison, terms: tuple[Term, ...], catalogue: Mapping[str, Effect]) -> bool:
        return any(term.effect == "warm_up" for term in terms) or is_worse(comparison, terms, catalogue)

    monkeypatch.setattr(stepwise, "held_out_rises", rises)
    verdict = hidden("Y+", "warm_up", 5, 20_024)
    assert (verdict.form, verdict.named, verdict.depends_on[0]) == ("unexplained", (), "temperature_c")


@pytest.mark.slow
def test_the_delay_of_an_effect_of_the_temperature_is_no_second_effect() -> None:
    verdict = hidden("Y+", "temperature_rate", 100, 20_021)
    assert verdict.groups == (("temperature_rate",),)
