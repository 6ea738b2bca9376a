"""The catalogue as the services report it."""

from __future__ import annotations

from labctl.services.effects import catalogue


def test_every_effect_tells_the_unit_of_its_sizes_and_whether_it_leaves() -> None:
    effects = {each["id"]: each for each in catalogue().effects}
    assert all(each["unit"] for each in effects.values())
    reported = ["bias", "scale_factor", "bias_temperature", "run_shift", "thermometer_error"]
    assert [effects[name]["unit"] for name in reported] == ["deg/s", "1", "deg/s/K", "deg/s", "K"]
    assert effects["misalignment"]["leaves"]
    assert not effects["table_tilt"]["leaves"]  # the bench's own
    assert not effects["g_sensitivity"]["leaves"]  # the unit's, but gravity is not known where it is used
