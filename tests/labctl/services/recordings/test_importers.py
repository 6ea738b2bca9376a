"""Which importer reads a file, and what becomes of one that cannot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from labctl.errors import BadInput, BadRecording
from labctl.recording import Importer, NoOptions, Recording, RecordingInfo, read_recording
from labctl.services.recordings.importers import IMPORTERS, as_interchange, parsed_options, surest
from tests.helpers.paths import EXAMPLES
from tests.helpers.plugins import register

HEAD = {"serial": "A-1", "axes": ("z",), "kind": "points", "started_at": "2026-01-05T08:00:00Z"}


def made(**columns: Any) -> Recording:
    whole = {"dataset": [1, 2], "table_rate_dps": [0.0, 10.0], "temperature_c": [25.0, 25.0], "gyro_z": [0.1, 10.1]}
    return Recording(RecordingInfo.model_validate(HEAD), {**whole, **columns})


def importer(sure: float, read: Callable[[Path, Any], Any] = lambda *_: made()) -> Importer[NoOptions]:
    return Importer("a test's file", lambda _: sure, read, NoOptions)


def failing(*_: Any) -> Any:
    raise KeyError("row")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "some.log"
    path.write_text("text", encoding="utf-8")
    return path


def test_the_surest_importer_reads(monkeypatch: pytest.MonkeyPatch, file: Path) -> None:
    register(monkeypatch, IMPORTERS, "half", importer(0.5, failing))
    register(monkeypatch, IMPORTERS, "sure", importer(0.9))
    assert surest(file) == "sure"
    with as_interchange(file) as folder:
        again = read_recording(folder)
        assert again.info.notes == "read from some.log by importer sure of acme-plugins 0.3"
        assert again.columns["gyro_z"].tolist() == [0.1, 10.1]
    assert not folder.exists()


def test_two_that_are_equally_sure_are_a_question(monkeypatch: pytest.MonkeyPatch, file: Path) -> None:
    register(monkeypatch, IMPORTERS, "one", importer(True))
    register(monkeypatch, IMPORTERS, "other", importer(1.0))
    with pytest.raises(
        BadInput, match="the importers one and other recognise the file equally well; choose one with --format"
    ):
        surest(file)


def test_a_probe_that_fails_is_said_and_no_reason_to_ask_no_other(
    monkeypatch: pytest.MonkeyPatch, file: Path, caplog: pytest.LogCaptureFixture
) -> None:
    register(monkeypatch, IMPORTERS, "bad", Importer("bad", failing, failing, NoOptions))
    register(monkeypatch, IMPORTERS, "sure", importer(0.9))
    assert surest(file) == "sure"
    (record,) = caplog.records
    assert "entry point 'bad' (acme:bad) of acme-plugins 0.3" in record.getMessage()
    assert "cannot probe" in record.getMessage()


def test_the_interchange_format_needs_no_copy() -> None:
    with as_interchange(EXAMPLES / "osu-fog") as folder:
        assert folder == EXAMPLES / "osu-fog"


@pytest.mark.parametrize("name", ["nothing", "."])
def test_what_no_importer_knows_is_left_to_labctls_own(tmp_path: Path, name: str) -> None:
    with as_interchange(tmp_path / name) as folder, pytest.raises(BadRecording, match=r"recording\.toml: not found"):
        read_recording(folder)


@pytest.mark.parametrize(
    ("read", "error"),
    [
        (failing, "some.log: entry point 'bad' .* cannot read it: KeyError: 'row'; repair or uninstall acme-plugins"),
        (lambda *_: None, "cannot read it: TypeError: None is not a labctl.recording.recording.Recording"),
        (lambda *_: made(gyro_z=[1.0]), "columns of different length, or none .*dataset: 2, .*gyro_z: 1"),
        (lambda *_: made(gyro_z=[1.0, float("nan")]), "some.log: column 'gyro_z', row 2: nan is not a number"),
        (
            lambda *_: made(temperature_c=[25.0, -300.0]),
            "some.log: column 'temperature_c', row 2: -300 is outside the possible range",
        ),
        (lambda *_: made(dataset=np.array([1, 1])), "some.log: column 'dataset', row 2: number 1 is repeated"),
    ],
)
def test_what_an_importer_gives_is_held_to_the_rules(
    monkeypatch: pytest.MonkeyPatch, file: Path, read: Callable[..., Any], error: str
) -> None:
    register(monkeypatch, IMPORTERS, "bad", importer(1.0, read))
    with pytest.raises(BadRecording, match=error), as_interchange(file):
        pass


@pytest.mark.parametrize("texts", [["serial"], ["=A"], ["a=1", "a=2"]])
def test_options_are_key_and_value(texts: list[str]) -> None:
    with pytest.raises(BadInput, match="--option"):
        parsed_options(texts)


def test_an_option_of_an_importer_that_has_none_is_refused(file: Path) -> None:
    given = as_interchange(EXAMPLES / "osu-fog", options=["serial=A"])
    with pytest.raises(BadInput, match=r"option serial: .* \(it has no options\)"), given:
        pass
    with pytest.raises(BadInput, match="no importer 'lag' is installed"), as_interchange(file, "lag"):
        pass
