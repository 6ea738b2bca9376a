"""Descriptions of instruments that answer requests: units, patterns, and one clear error for each mistake."""

from __future__ import annotations

import copy
import re
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from pydantic import ValidationError

from instruments.protocols.request_reply.chamber import ChamberDescription
from instruments.protocols.request_reply.parts import AskAlarms, AskNumber, AskState, AskText
from instruments.protocols.request_reply.settings import DescribedTableSettings, shipped_descriptions
from instruments.protocols.request_reply.table import TableDescription
from instruments.protocols.request_reply.templates import as_written, filled
from instruments.protocols.request_reply.units import TEMPERATURES, temperature_unit
from instruments.toml_documents import read_toml
from labctl.errors import BadInput
from labctl.services.benches.described_instruments import check_description, read_description
from tests.helpers.paths import ROOT

FOLDER = ROOT / "examples" / "line-instruments"
TABLE = read_toml(FOLDER / "esp301-table.toml")
CHAMBER = read_toml(FOLDER / "scpi-chamber.toml")


def changed(document: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Return a document with other values at dotted places; None removes one."""
    found = copy.deepcopy(document)
    for place, value in changes.items():
        *parents, key = place.split(".")
        section = found
        for parent in parents:
            section = section.setdefault(parent, {})
        if value is None:
            section.pop(key, None)
        else:
            section[key] = value
    return found


@pytest.mark.parametrize(
    ("document", "changes", "said"),
    [
        (TABLE, {"stop": None}, "a table must say how it is stopped: add stop = [...], the commands"),
        (TABLE, {"standing": None}, "a table must say how its standing is confirmed: add [standing] with a request"),
        (TABLE, {"stop": []}, "labctl turns no table without"),
        (TABLE, {"position": None}, "how its angle is read: add [position] with a request"),
        (TABLE, {"standing.no": None}, "give one rule for its answer: both yes and no (patterns), or any_set"),
        (TABLE, {"move": ["{axis}PR{angle:.3f}"]}, "give either run (commands after which the table turns until"),
        (TABLE, {"run": "{axis}MV{sign}"}, "run: no line holds the rate; write it like {rate:.4f} or {speed:.4f}"),
        (TABLE, {"run": "{axis}VA{speed:.4f}"}, "run: no line holds the direction; write {rate:.4f}"),
        (TABLE, {"run": ["{axis}VA{speed}", "{axis}MV{sign}"]}, "{speed} does not say how the number is written"),
        (TABLE, {"run": ["{axis}VA{sped:.4f}", "{axis}MV{sign}"]}, "{sped} is not known here (known: rate, speed"),
        (TABLE, {"run": "{axis.real}VA"}, "{axis.real} is not a name; write {name}"),
        (TABLE, {"stop": "1ST\r1MO"}, "is not one line of text"),
        (TABLE, {"rate_unit": "deg/h"}, "unit 'deg/h' of rate is not known; choose one of deg/s, mdeg/s"),
        (TABLE, {"rate_unit": "count/s"}, "needs counts_per_turn: the counts of one whole turn; add it"),
        (TABLE, {"max_rate_dps": -80}, "max_rate_dps: Input should be greater than 0 (is -80)"),
        (TABLE, {"negative": "+"}, "positive and negative are both '+'; give each direction its own text"),
        (TABLE, {"position.reply": r"(\d+)"}, "has no group (?P<value>...); put it around the value"),
        (TABLE, {"identity.reply": "(?P<text>ESP"}, "is not a regular expression"),
        (TABLE, {"line.timeout_s": 0.0}, "line.timeout_s: Input should be greater than or equal to 0.05 (is 0.0)"),
        (TABLE, {"line.refusal": "ERR"}, "pattern 'ERR' has no group (?P<why>...)"),
        (TABLE, {"parameters.axis": "1\r2"}, "is not a printable text under a name; correct it"),
        (TABLE, {"stopp": "x"}, "stopp: Extra inputs are not permitted (is 'x')"),
        (TABLE, {"kind": "tabel"}, "kind: is 'tabel', but it must say what is described: choose one of table, chamber"),
        (CHAMBER, {"unit": "C"}, "unit 'C' of temperature is not known; choose one of deg C, K, deg F"),
        (CHAMBER, {"min_c": 130.0}, "min_c = 130 deg C must be below max_c = 120 deg C"),
        (CHAMBER, {"set": "SOUR:TEMP 20"}, "set: no line holds the set point; write it like {setpoint:.1f}"),
        (CHAMBER, {"running": None}, "switch_on is there, but not how its effect is confirmed; add [running]"),
        (CHAMBER, {"air.reply": "(?P<value>.*)"}, "has both reply and field; keep one of the two"),
        (CHAMBER, {"setpoint": None}, "setpoint: Field required"),
    ],
)  # fmt: skip
def test_each_mistake_is_said(tmp_path: Path, document: dict[str, Any], changes: dict[str, Any], said: str) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(tomli_w.dumps(changed(document, changes)), newline="")
    with pytest.raises(BadInput, match=re.escape(said)) as caught:
        read_description(str(path))
    assert str(caught.value).startswith(f"description {path}: ")
    assert "\n" not in str(caught.value)


def test_a_bench_stays_within_the_limits_of_its_instrument() -> None:
    section = {"driver": "line-table", "port": "x", "format": TABLE, "max_rate_dps": 60, "acceleration_dps2": 60}
    for changes, said in (
        ({"max_rate_dps": 90}, "max_rate_dps = 90 deg/s is beyond the limit of 'Newport ESP301', 80 deg/s; lower it"),
        ({"parameters": {"axle": 2}}, "has no parameter 'axle' (it has: axis)"),
        ({"format": changed(TABLE, {"encoder": False}), "reference": "measured"}, "is not measured (encoder = false"),
        ({"port": None}, "give either port"),
        ({"port": None, "host": "10.0.0.1"}, "tcp_port is missing"),
    ):
        with pytest.raises(ValidationError, match=re.escape(said)):
            DescribedTableSettings.model_validate({**section, **changes})
    assert DescribedTableSettings.model_validate(section).baudrate == 19200, "as the description says"


def test_every_description_that_ships_is_valid() -> None:
    for name in (*shipped_descriptions(), *map(str, FOLDER.glob("*.toml"))):
        answer = check_description(name, None, None)
        assert answer.ok
        assert answer.checks


def test_units_and_decimals() -> None:
    for name, freezing in {"deg C": 0.0, "K": 273.15, "deg F": 32.0}.items():
        assert temperature_unit(name).read(freezing) == pytest.approx(0, abs=1e-12)
        assert temperature_unit(name).written(0.0) == pytest.approx(freezing)
    assert set(TEMPERATURES) == {"deg C", "K", "deg F"}
    counts = TableDescription.model_validate(
        changed(TABLE, {"counts_per_turn": 36000, "rate_unit": "count/s", "run": "{axis}JG{rate:+d}"})
    )
    assert counts.turning.read(100) == pytest.approx(1.0)
    assert filled(counts.run[0], {"axis": 2, "rate": counts.turning.written(-1.234)}) == "2JG-123"
    assert as_written(counts.run, "rate", counts.turning.written(1.234)) == 123
    assert ChamberDescription.model_validate(CHAMBER).temperature.read(212) == pytest.approx(100)


def test_replies() -> None:
    field = AskNumber(send="X?", field=1).pattern
    found = re.fullmatch(field, "TEMP, +2.51E+01 ,C")
    assert found is not None
    assert float(found["value"]) == 25.1
    assert re.fullmatch(field, "TEMP") is None
    assert re.fullmatch(field, "TEMP,nan") is None
    assert re.fullmatch(AskNumber(send="X?").pattern, " -.5 ") is not None
    text = re.fullmatch(AskText(send="X?", field=2, separator="; ").pattern, "a; b; c d; e")
    assert text is not None
    assert text["text"] == "c d"


def test_states_and_alarms() -> None:
    words = AskState(send="S?", yes="STOP.*", no=".*MOV.*")
    assert [words.holds(each) for each in ("STOPPED", "MOVING", "STOP MOV", "?")] == [True, False, False, None]
    assert [AskState(send="S?", any_set=6).holds(each) for each in ("2", "4", "8", "x", "-2")] == [
        True, True, False, None, None,
    ]  # fmt: skip
    assert AskState(send="S?", none_set=1).holds("2") is True
    assert AskState(send="S?", below=0.01).holds("-0.02") is False
    alarms = AskAlarms(send="A?", none="0", bits={"1": "low", "4": "high"})
    assert [alarms.alarms(each) for each in ("0", "5", "2", "E7")] == [(), ("low", "high"), ("alarm 2",), ("alarm E7",)]


def test_the_page_shows_the_examples_as_they_are() -> None:
    page = (ROOT / "docs" / "how-to" / "request-reply.md").read_text(encoding="utf-8")
    for each in FOLDER.glob("*.toml"):
        assert f"**`{each.name}`**\n\n```toml\n{each.read_text(encoding='utf-8')}```" in page
