"""Units whose ports or adapters have changed places do not go under each other's serial number."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from instruments.bench_config import BenchFile
from instruments.clock import VirtualClock
from instruments.errors import WrongInstrument
from instruments.transport.adapters import adapter_of
from labctl.answers.campaigns import ResumeRequest
from labctl.cli.printing.campaigns import print_campaign
from labctl.errors import Conflict
from labctl.services.campaigns.preparation import prepare
from labctl.services.campaigns.resume import prepare_resume
from labctl.services.campaigns.status import campaign_status
from labctl.services.planning.loading import load_bench
from labctl.store import Store, open_store

#: How a simulated unit is set.
SET = {
    "firmware": "12", "revision": "K", "output_unit": "rate", "filter_hz": "262 262 262", "g_compensation": "off",
    "range_dps": "400 400 400", "datagram": "0x94", "sample_rate_hz": "125", "bias_trim_dps": "0 0 0",
}  # fmt: skip
OWN = {"a": "N25580000000001", "b": "N25580000000002"}


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


@pytest.fixture
def plugged(monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """Port -> USB adapter."""
    adapters: dict[str, str] = {}

    def found(port: str | None) -> str:
        return adapters.get(port or "", "")

    monkeypatch.setattr("instruments.transport.adapters.adapter_of", found)
    monkeypatch.setattr("labctl.services.benches.identity.adapter_of", found)
    return adapters


def stims(**own: str) -> BenchFile:
    """Two STIM300, `a` and `b`, with the serial numbers that they say themselves."""
    record = load_bench("triaxial-sim").model_dump()
    unit = record["gyros"][0]
    record["gyros"] = [unit | {"name": n, "serial": f"UNIT-{n.upper()}", "port": f"sim://stim300/{n}"} for n in "ab"]
    record["simulation"]["units"] = {name: {"device": {"serial": serial}} for name, serial in (OWN | own).items()}
    return BenchFile.model_validate(record)


def begin(store: Store, bench: BenchFile) -> Any:
    prepared = prepare(store, "short", bench, VirtualClock(), clip=True)
    prepared.bench.close()
    return prepared


def with_gyro(bench: BenchFile, name: str, **changes: Any) -> BenchFile:
    gyros = tuple(gyro.model_copy(update=changes if gyro.name == name else {}) for gyro in bench.gyros)
    return bench.model_copy(update={"gyros": gyros})


def test_what_units_say_is_kept_and_shown(store: Store, capsys: pytest.CaptureFixture[str]) -> None:
    begin(store, stims())
    answer = campaign_status(store, 1)
    assert answer.reported["a"] == {"serial": OWN["a"], **SET}
    (recording,) = [each for each in store.recordings.of_unit("UNIT-A") if each.info]
    assert recording.info["configuration"] == SET
    print_campaign(answer)
    assert f"a says: serial {OWN['a']}, firmware 12, revision K, output unit rate" in capsys.readouterr().out


def test_exchanged_units_are_refused_in_one_line(store: Store) -> None:
    begin(store, stims())
    begin(store, stims())
    with pytest.raises(Conflict) as told:
        begin(store, stims(a=OWN["b"], b=OWN["a"]))
    assert str(told.value) == (
        f"a: the unit reports serial number {OWN['b']}, which b had: the two are exchanged, but in "
        f"campaign 2 unit UNIT-A reported {OWN['a']}. Connect the right unit; or, for another unit, "
        f"give it a different `serial`; or, if this is the right unit, set own_serial = '{OWN['b']}' in the bench file"
    )


def test_a_unit_is_known_on_every_bench_and_a_bench_file_may_name_another(store: Store) -> None:
    begin(store, stims())
    other = stims(a="N25580000000009").model_copy(update={"name": "other"})
    with pytest.raises(Conflict, match=r"a: the unit reports serial number N25580000000009, but in campaign 1"):
        begin(store, other)
    begin(store, with_gyro(other, "a", own_serial="N25580000000009"))
    begin(store, other)  # it is the known one by now


def test_a_bench_file_that_names_another_unit_than_answers_is_refused(store: Store) -> None:
    with pytest.raises(
        WrongInstrument, match=f"has serial number {OWN['a']}, but the bench file or the campaign names N1; connect"
    ):
        begin(store, with_gyro(stims(), "a", own_serial="N1"))


def set_otherwise(**device: Any) -> BenchFile:
    """The two units, of which `a` is set otherwise."""
    bench = stims()
    assert bench.simulation is not None
    units = bench.simulation.units
    units["a"]["device"] = {**units["a"]["device"], **device}  # type: ignore[dict-item]
    return bench


@pytest.mark.parametrize(
    ("device", "said", "stated"),
    [
        ({"filter_hz": 16}, "filter_hz was 262 262 262 and is 16 16 16", {"filter_hz": "16 16 16"}),
        (
            {"g_compensation": "scale by accelerometer"},
            "g_compensation was off and is scale by accelerometer",
            {"g_compensation": "scale by accelerometer"},
        ),
        ({"bias_trim_dps": (0.5, 0.0, 0.0)}, "bias_trim_dps was 0 0 0 and is 0.5 0 0", {"bias_trim_dps": "0.5 0 0"}),
    ],
)
def test_a_unit_that_is_set_otherwise_than_before_is_refused_until_the_bench_file_states_it(
    store: Store, device: dict[str, Any], said: str, stated: dict[str, str]
) -> None:
    begin(store, stims())
    ((name, value),) = stated.items()
    with pytest.raises(Conflict) as told:
        begin(store, set_otherwise(**device))
    assert str(told.value) == (
        f"a: unit UNIT-A is set otherwise than in campaign 1: {said}. Its calibration may not hold so. Set the unit as "
        "it was; or, if this is meant, state it in the section of the unit in the bench file: "
        f'configuration = {{ {name} = "{value}" }}'
    )
    begin(store, with_gyro(set_otherwise(**device), "a", configuration=stated))
    with pytest.raises(Conflict, match=rf"is not set as the bench file states: {name} is .* instead of "):
        begin(store, with_gyro(stims(), "a", configuration=stated))


def test_what_a_unit_of_older_firmware_does_not_say_is_not_compared(store: Store) -> None:
    begin(store, stims())
    begin(store, set_otherwise(bias_trim_dps=None))
    with pytest.raises(Conflict, match=r"states: it does not report bias_trim_dps \(0 0 0\); set the unit so"):
        begin(store, with_gyro(set_otherwise(bias_trim_dps=None), "a", configuration={"bias_trim_dps": "0 0 0"}))


def fog(**changes: Any) -> BenchFile:
    return with_gyro(load_bench("single-axis-sim"), "fog", **changes)


def test_another_adapter_is_refused_where_the_wire_tells_nothing(store: Store, plugged: dict[str, str]) -> None:
    bench = load_bench("single-axis-sim")
    ports = {name: section.port for name, section in bench.instruments.items()}
    port = bench.gyros[0].port
    assert port is not None
    plugged |= {port: "A1", ports["table"]: "A2"}
    name = bench.gyros[0].name
    begin(store, bench)
    assert campaign_status(store, 1).reported == {"table": {"adapter": "A2"}, name: {"adapter": "A1"}}
    begin(store, bench)
    plugged |= {port: "A2", ports["table"]: "A1"}
    with pytest.raises(Conflict, match=rf"{name}: port \S+ is on USB adapter A2, which table was on: two adapters may"):
        begin(store, bench)
    plugged |= {port: "A1", ports["table"]: "A7"}
    with pytest.raises(
        Conflict, match=r"table: port \S+ is on USB adapter A7; in campaign 2 the adapter was A2. Give the correct"
    ):
        begin(store, bench)
    begin(store, bench.model_copy(update={"table": bench.table.model_copy(update={"adapter": "A7"})}))


def test_a_port_on_another_adapter_than_the_file_names_is_not_opened(store: Store, plugged: dict[str, str]) -> None:
    bench = load_bench("single-axis-sim")
    bench = bench.model_copy(update={"table": bench.table.model_copy(update={"adapter": "A7"})})
    with pytest.raises(
        WrongInstrument, match=r"table: port \S+ is on USB adapter without a serial number, but the bench file or"
    ):
        begin(store, bench)
    plugged[bench.table.port or ""] = "A7:1.2"  # the third port of it
    begin(store, bench)


def test_a_resumed_campaign_takes_only_the_units_that_it_began_with(store: Store) -> None:
    begin(store, stims())
    exchanged = stims(a=OWN["b"], b=OWN["a"])
    resumed = prepare_resume(store, 1, exchanged, lambda _: VirtualClock(), ResumeRequest(by="Ann"))
    with pytest.raises(
        WrongInstrument, match=f"has serial number {OWN['b']}, but the bench file or the campaign names {OWN['a']}"
    ):
        resumed.bench.gyros["a"].identify()
    resumed.bench.close()


def test_each_port_of_an_adapter_with_several_has_its_own_identity(monkeypatch: pytest.MonkeyPatch) -> None:
    class Port:
        device, serial_number, location = "/dev/ttyUSB3", "FT4", "1-1.4:1.2"

    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [Port])
    assert adapter_of("/dev/ttyUSB3") == "FT4:1.2"
    Port.location = "1-1.4"
    assert adapter_of("/dev/ttyUSB3") == "FT4"
    assert adapter_of("sim://arrick") == adapter_of("/dev/ttyS0") == ""
