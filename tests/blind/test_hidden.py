"""A fixed selection of the study: something is hidden at a size z, or nothing is, and the criticism does not know it.

Sizes are those of `studies/effect_sizes.json`. `make study` runs the whole of it, with rates and intervals.
"""

from __future__ import annotations

import pytest

from labctl.fitting.criticism import Criticism, criticise
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.models.presets import preset_for
from labctl.recording import Recording
from studies.campaigns import MODELS, campaign
from studies.effect_sizes import sizes

SINGLE = (
    ("O", "scale_factor_asymmetry", 10),
    ("O", "dead_band", 30),
    ("O", "vibration_rectification", 30),
    ("O", "table_rate_ripple", 10),
    ("O", "rate_hysteresis", 30),
    ("O", "start_transient", 10),
    ("O+", "thermal_lag", 30),
    ("O+", "thermal_hysteresis", 30),
    ("O+", "bias_drift", 100),
    ("O+", "supply_sensitivity", 10),
    ("O+", "table_tilt", 30),
    ("O+", "saturation", 100),
    ("Y", "scale_factor_odd", 30),
    ("Y+", "warm_up", 30),
    ("Y", "mounting_shift", 10),
)


def criticised(protocol: str, recording: Recording) -> Criticism:
    model, _ = preset_for(MODELS[protocol], []).build(fit_data_of(recording))
    return criticise(recording, model, full=False)


@pytest.mark.slow
@pytest.mark.parametrize(("protocol", "effect", "z"), SINGLE)
def test_what_is_hidden_is_named_alone_or_among_its_likes(protocol: str, effect: str, z: int) -> None:
    found = criticised(protocol, campaign(protocol, 600 + z, {effect: sizes(protocol)[effect][f"{z:g}"]}))
    assert effect in found.verdict.named, (found.verdict.form, found.verdict.named)


@pytest.mark.parametrize("seed", range(700, 703))
@pytest.mark.parametrize("protocol", ["O", "O+"])
def test_nothing_is_named_where_nothing_is_hidden(protocol: str, seed: int) -> None:
    assert criticised(protocol, campaign(protocol, seed, {})).verdict.form == "adequate"


@pytest.mark.slow
def test_nothing_is_named_on_three_axes() -> None:
    assert criticised("Y", campaign("Y", 707, {})).verdict.form == "adequate"


@pytest.mark.parametrize(("protocol", "z"), [("O", 100), ("O+", 30)])
def test_what_no_effect_describes_is_unexplained_and_hangs_on_its_channel(protocol: str, z: int) -> None:
    size = sizes(protocol)["outside_etalon"][f"{z:g}"]
    verdict = criticised(protocol, campaign(protocol, 708, {"outside_etalon": size})).verdict
    assert (verdict.form, verdict.named, verdict.depends_on[0]) == ("unexplained", (), "temperature_c")
