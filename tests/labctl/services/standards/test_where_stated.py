"""Where standards are stated: one answer, by where the measurements came from."""

from __future__ import annotations

import pytest

from labctl.services.certificates import remedies
from labctl.services.standards.where_stated import place_of_standards, remedy_of_unstated


@pytest.mark.parametrize(
    ("imported", "place", "other"), [(True, "recording.toml", "bench file"), (False, "bench file", "recording.toml")]
)
def test_every_sentence_names_the_file_that_counts_and_no_other(imported: bool, place: str, other: str) -> None:
    for text in (
        place_of_standards(imported=imported),
        remedy_of_unstated(["clock", "earth_rate"], imported=imported),
        remedies.of_standards(imported),
    ):
        assert place in text
        assert other not in text


def test_only_what_a_file_can_state_is_asked_for() -> None:
    assert remedy_of_unstated(["table_time_common"], imported=True) == ""
    said = remedy_of_unstated(["earth_rate"], imported=False)
    assert (
        said
        == "State latitude_deg for earth_rate in the bench file; then measure the unit again and fit the new recording."
    )
