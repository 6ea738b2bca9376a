"""Templates: each is a log whose map is proposed whole."""

from __future__ import annotations

from pathlib import Path

import pytest

from labctl.errors import BadInput
from labctl.recording.column_map import propose, recording_of
from labctl.recording.column_map.templates import KINDS, template
from labctl.recording.logs.text import TextOptions, read_text


@pytest.mark.parametrize("kind", KINDS)
def test_a_template_is_mapped_whole(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"{kind}.csv"
    path.write_text(template(kind), encoding="utf-8")
    table = read_text(path, TextOptions())
    column_map = propose(table).column_map.model_copy(update={"motion": kind})
    if "data set" in table.columns:
        column_map = column_map.model_copy(
            update={"datasets": column_map.datasets.model_copy(update={"by": "column", "column": "data set"})}
        )
    log = recording_of(table, column_map)
    assert log.motion == kind
    assert log.unused == []
    assert log.recording.info.axes == ("x", "y", "z")


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(BadInput, match="choose one of rates, rest, turns, profile, poses"):
        template("flight")
