"""`labctl standards` and `labctl environment`: what is entered, printed, and answered by the exit status."""

from __future__ import annotations

from datetime import date
from pathlib import Path

import pytest

from instruments.bench_config import shipped_benches
from labctl.store import open_store
from tests.helpers import register
from tests.helpers.lab import Lab
from tests.helpers.register import COUNTER, thermometer

CERTIFICATE = ("standards", "certificate", "Pt100-7", "--laboratory", "DKD", "--by", "M")


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    found = Lab(tmp_path)
    found.run("standards", "add", "Pt100-7", "--quantity", "thermometer", "--serial", "SN-0815", "--by", "M")
    return found


def test_a_standard_is_added_certified_checked_and_listed(lab: Lab) -> None:
    assert "no certificate" in lab.run("standards", "list").stdout
    lab.run(*CERTIFICATE, "--number", "T-1", "--calibrated", "2024-01-10", "--point", "0.01:0.04")
    shown = lab.run("standards", "show", "SN-0815", "--on", "2024-06-01").stdout
    assert "on 2024-06-01: error 0.01, u = 0.02 deg C; drift unknown: one certificate; u holds no" in shown
    second = lab.json(*CERTIFICATE, "--number", "T-2", "--calibrated", "2025-01-10", "--point", "0.030:0.04")
    assert [each["number"] for each in second["certificates"]] == ["T-1", "T-2"]
    (found,) = lab.json("standards", "list", "--on", "2025-07-11")
    assert found["predictions"][0]["value"] == pytest.approx(0.04, abs=1e-3)
    check = ("standards", "check", "Pt100-7", "--u", "0.01", "--by", "T")
    assert lab.json(*check, "--value", "0.05", "--at", "2025-07-11")["state"] == "valid"
    out = lab.run(*check, "--value", "0.5", status=1).stdout
    assert "Check standard Pt100-7" in out
    assert "is out of the control limits" in out


def test_points_at_nominals(lab: Lab) -> None:
    answer = lab.json(
        *CERTIFICATE, "--number", "T-1", "--calibrated", "2024-01-10", "--k", "3", "--point", "-40:0.01:0.06",
        "--point", "85::0.09",
    )  # fmt: skip
    points = answer["certificates"][0]["points"]
    assert [(each["nominal"], each["value"], each["u"]) for each in points] == [
        (-40.0, 0.01, pytest.approx(0.02)), (85.0, None, pytest.approx(0.03)),
    ]  # fmt: skip


@pytest.mark.parametrize("point", ["0.01", "a:0.1", "1:2:3:4", "0.01:", "::"])
def test_a_point_that_cannot_be_read_is_refused(lab: Lab, point: str) -> None:
    result = lab.run(*CERTIFICATE, "--number", "T", "--calibrated", "2024-01-10", "--point", point, status=2)
    assert "write [NOMINAL:]ERROR:U" in result.stderr


def test_what_is_wrong_is_one_line_with_status_2(lab: Lab) -> None:
    for arguments, said in (
        (("show", "Pt100-9"), "is not in the register"),
        (("add", "a/b", "--quantity", "thermometer"), "--label 'a/b'"),
        (("list", "--on", "yesterday"), "--on 'yesterday' is not a day; write it as 2027-11-23"),
        (("check", "Pt100-7", "--value", "1", "--u", "0"), "--u 0.0: input should be greater than 0"),
        (("check", "Pt100-7", "--value", "1", "--u", "1", "--at", "noon"), "--at 'noon' is not a time"),
        (("bad", "Pt100-7", "--from", "2025-02-01", "--until", "2025-01-01", "--reason", "r"), "before bad_from"),
        (("compare", "A", "B:1"), "write SERIAL:VERSION"),
    ):
        result = lab.run("standards", *arguments, status=None)
        assert result.exit_code in {1, 2}, arguments
        assert said in result.stderr
        assert result.stderr.count("\n") <= 2


def test_a_bad_standard_lists_what_it_touched(lab: Lab) -> None:
    with open_store(str(lab.database), write=True) as store:
        register.measured(store, "FOG-B", date(2025, 7, 7), COUNTER, thermometer("T-1"))
    days = ("--from", "2025-04-01", "--until", "2025-09-01")
    out = lab.run("standards", "bad", "Pt100-7", *days, "--reason", "broken").stdout
    assert "FOG-B" in out
    assert "1 calibration of 1 unit was measured with standard Pt100-7 on these days." in out
    assert lab.json("standards", "affected", "Pt100-7")["calibrations"][0]["findings"] == [1]
    assert lab.json("standards", "affected", "Pt100-7", "--until", "2025-01-01")["calibrations"] == []
    rows = lab.run("standards", "show", "Pt100-7").stdout
    assert "finding 1: bad from 2025-04-01 until 2025-09-01: broken" in rows
    lab.run("standards", "withdraw", "Pt100-7", "--finding", "1", "--reason", "was right", "--by", "Q")
    assert "withdrawn: Q" in lab.run("standards", "show", "Pt100-7").stdout
    lab.run("audit", "verify")


def test_the_charts_of_a_check_gyro(lab: Lab) -> None:
    with open_store(str(lab.database), write=True) as store:
        register.measured(store, "FOG-B", date(2025, 7, 7), COUNTER)
    out = lab.run("standards", "check-gyro", "FOG-B").stdout
    assert "FOG-B is no check gyro; --mark makes it one" in out
    assert "the first result; control limits need a second one" in out
    assert "--reason" in lab.run("standards", "check-gyro", "FOG-B", "--mark", status=2).stderr
    answer = lab.json("standards", "check-gyro", "FOG-B", "--mark", "--reason", "stays here", "--temperature-c", "25")
    assert (answer["marked"], answer["alarm"], answer["temperature_c"]) == (True, False, 25.0)


@pytest.mark.slow
def test_two_versions_are_compared(lab: Lab) -> None:
    with open_store(str(lab.database), write=True) as store:
        register.measured(store, "FOG-B", date(2025, 7, 7), COUNTER)
        register.measured(store, "FOG-B", date(2025, 8, 7), COUNTER)
    out = lab.run("standards", "compare", "FOG-B:1", "FOG-B:2").stdout
    assert "All 2 results agree within their expanded uncertainties" in out
    assert "Both calibrations rest on clock (counter, certificate C-1)" in out
    assert lab.json("standards", "compare", "FOG-B:1", "FOG-B:2")["results"][0]["en"] == 0.0


def test_the_check_of_a_bench_reads_the_register_and_makes_no_database(tmp_path: Path) -> None:
    empty = Lab(tmp_path / "new")
    empty.json("bench", "check", "single-axis-sim")
    assert not empty.database.exists()
    lab = Lab(tmp_path)
    lab.run("standards", "add", "step clock", "--quantity", "clock", "--by", "M")
    found = lab.json("bench", "check", "single-axis-sim")
    assert found["devices"][-1]["device"] == "standards"
    assert "agrees with the register: step clock" in lab.run("bench", "check", "single-axis-sim").stdout
    lab.run("standards", "bad", "step clock", "--from", "2026-01-01", "--reason", "stopped", "--by", "M")
    assert "step clock was found bad" in lab.run("bench", "check", "single-axis-sim", status=1).stdout


def test_the_check_of_a_bench_needs_no_database_that_can_be_read(tmp_path: Path) -> None:
    """A bench without standards asks for none; one with standards says that the register was not read, and why."""
    lab = Lab(tmp_path)
    lab.database.write_bytes(b"no database" * 1000)
    found = lab.json("bench", "check", "single-axis-sim")
    (register,) = [each for each in found["devices"] if each["device"] == "standards"]
    assert (found["ok"], register["state"]) == (True, "doubtful")
    assert "the register was not read" in register["text"]
    assert str(lab.database) in register["text"]
    text = (shipped_benches()["single-axis-sim"]).read_text(encoding="utf-8")
    path = tmp_path / "plain.toml"
    path.write_text(text[: text.index("[[standards]]")], encoding="utf-8")
    plain = lab.json("bench", "check", str(path))
    assert [each["device"] for each in plain["devices"]] == ["table", "chamber", "fog"]
    assert lab.json("campaign", "plan", "short", "--bench", str(path))["learned"] == []  # a forecast does without, too


def test_the_room_is_typed_and_shown(lab: Lab) -> None:
    arguments = ("environment", "add", "--source", "TH-3", "--by", "T", "--at", "2026-01-05T09:00Z")
    lab.run(*arguments, "--temperature-c", "21.5", "--humidity-pct", "40")
    answer = lab.json(*arguments, "--pressure-hpa", "1013", "--temperature-c", "22")
    assert {each["value"] for each in answer["readings"][:2]} == {22.0, 1013.0}
    shown = lab.json("environment", "show", "--from", "2026-01-05", "--until", "2026-01-05")
    assert {each["quantity"]: (each["low"], each["high"]) for each in shown["spans"]} == {
        "humidity": (40.0, 40.0), "pressure": (1013.0, 1013.0), "temperature": (21.5, 22.0),
    }  # fmt: skip
    assert "nothing was read" in lab.run(*arguments, status=2).stderr
    assert "is outside 500 to 1200 hPa" in lab.run(*arguments, "--pressure-hpa", "3", status=2).stderr
    assert "--value inf" in lab.run(*arguments, "--pressure-hpa", "inf", status=2).stderr
