"""Everything that can go wrong between a request and its reply comes out as one instrument error, in bounded time."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from instruments.clock import VirtualClock
from instruments.errors import InstrumentError, LimitError, LinkError, MalformedReply, NoReply, RequestRejected
from instruments.protocols.modbus_registers import Register
from instruments.simulators.links.factory import SimulatedLinks
from instruments.simulators.links.faults import Faults, FaultyWire
from instruments.simulators.links.modbus_device import ModbusDevice, constant, int16
from instruments.transport.factory import Ports
from instruments.transport.modbus import Registers
from instruments.transport.modbus_link import RETRY_PAUSES_S, Client, RefusedRegister
from instruments.transport.rtu import MIN_LATENCY_S, SILENCE_FACTOR

AIR = Register(100, "air temperature", "int16", "counts")
SETPOINT = Register(300, "set point", "int16", "counts", low=-400, high=1500, access="rw")
#: Three time-outs and what lies between them: pauses, or on RTU the wait for silence.
ALL_TRIES_S = {"tcp": 3 * 1.0 + sum(RETRY_PAUSES_S), "rtu": 3 * 1.0 + 2 * SILENCE_FACTOR * MIN_LATENCY_S}


class Bench:
    """One holding register to read, one to write, on either kind of link."""

    def __init__(self, framing: str, **options: Any) -> None:
        self.clock = VirtualClock()
        self.faults = Faults()
        self.held = 250
        self.writes: list[int] = []
        cells = {100: int16(lambda _: -221), 101: constant(7), 300: int16(lambda _: self.held, self._put)}
        self.device = ModbusDevice("tcp" if framing == "tcp" else "rtu", cells, self.faults)
        self.wire: Any = FaultyWire(self.device, self.faults)
        self.framing = framing
        self.clients: list[Client] = []
        self.registers = Registers("chamber", 1, self.clock, self.link, **options)

    def _put(self, value: int, _t_s: float) -> bool:
        self.writes.append(value)
        self.held = value
        return value != 666

    def link(self) -> Client:
        ports = Ports(self.clock, SimulatedLinks(lambda _: self.wire, self.clock))
        if self.framing == "tcp":
            self.clients.append(ports.modbus_tcp("sim://it", 502, device="chamber", timeout_s=1.0))
        else:
            self.clients.append(ports.modbus_rtu("sim://it", device="chamber", baudrate=19200, timeout_s=1.0))
        return self.clients[-1]


@pytest.fixture(params=["tcp", "rtu"])
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    made = Bench(request.param)
    yield made
    made.registers.close()


@pytest.fixture
def make_bench() -> Iterator[Callable[..., Bench]]:
    made: list[Bench] = []

    def make(framing: str, **options: Any) -> Bench:
        made.append(Bench(framing, **options))
        return made[-1]

    yield make
    for one in made:
        one.registers.close()


def test_nothing_is_opened_before_it_is_used(bench: Bench) -> None:
    assert bench.clients == []
    assert bench.registers.get(AIR) == -221
    assert len(bench.clients) == 1


def test_several_registers_in_a_row(bench: Bench) -> None:
    assert bench.registers.words(AIR, 2) == [0xFF23, 7]


def test_a_write_arrives_and_is_read_back(bench: Bench) -> None:
    bench.registers.put(SETPOINT, -221)
    assert bench.held == -221
    assert bench.registers.get_int(SETPOINT) == -221


def test_silence_is_named_after_bounded_time_without_a_real_second(bench: Bench) -> None:
    bench.faults.arm("silence")
    with pytest.raises(
        NoReply, match=r"chamber: no answer to read air temperature \(register 100\).*address 1 \(3 tri"
    ):
        bench.registers.get(AIR)
    assert bench.clock.now_s() == pytest.approx(ALL_TRIES_S[bench.framing], abs=0.01)


@pytest.mark.parametrize("kind", ["silence", "lost_reply", "wrong_crc", "noise", "split", "dropped_link"])
@pytest.mark.parametrize("times", [1, 2])
def test_a_passing_fault_is_survived(bench: Bench, kind: Any, times: int) -> None:
    assert bench.registers.get(AIR) == -221
    bench.faults.arm(kind, count=times, value=3)
    assert bench.registers.get(AIR) == -221
    assert bench.registers.words(AIR, 2) == [0xFF23, 7]


@pytest.mark.parametrize(
    ("kind", "error"),
    [("wrong_crc", MalformedReply), ("lost_reply", NoReply), ("merge", NoReply), ("dropped_link", LinkError)],
)
def test_a_lasting_fault_is_named_and_gone_with_its_cause(bench: Bench, kind: Any, error: type[Exception]) -> None:
    bench.faults.arm(kind)
    with pytest.raises(error, match=r"chamber: .*3 tries in"):
        bench.registers.get(AIR)
    assert bench.clock.now_s() < 2 * ALL_TRIES_S[bench.framing]
    bench.faults.clear()
    assert bench.registers.get(AIR) == -221


def test_the_link_is_opened_again_after_it_dropped(bench: Bench) -> None:
    bench.registers.get(AIR)
    bench.faults.arm("dropped_link", until_s=0.5)
    assert bench.registers.get(AIR) == -221
    assert bench.clock.now_s() == pytest.approx(1.1, abs=0.01)  # at 0 and at 0.1 s it was still gone
    assert len(bench.clients) == 1  # the same client: its transaction numbers go on


@pytest.mark.parametrize("code", [1, 2, 3, 4, 8, 10, 11])
def test_an_exception_reply_is_a_refusal_and_not_tried_again(bench: Bench, code: int) -> None:
    fault = bench.faults.arm("modbus_exception", value=code, count=5)
    with pytest.raises(RefusedRegister, match=rf"refused to read air temperature \(register 100\).*exception {code},"):
        bench.registers.get(AIR)
    assert fault.count == 4
    assert issubclass(RefusedRegister, RequestRejected)


@pytest.mark.parametrize(
    ("code", "name"),
    [
        (8, "the instrument has a memory parity error; switch it off and on"),
        (10, "gateway path unavailable; check the gateway's serial port"),
        (11, "gateway target device failed to respond; check address, power and cable behind the gateway"),
    ],
)
def test_exceptions_of_memories_and_gateways_have_names(bench: Bench, code: int, name: str) -> None:
    bench.faults.arm("modbus_exception", value=code, count=1)
    with pytest.raises(RefusedRegister, match=f"Modbus exception {code}, {name}"):
        bench.registers.get(AIR)


def test_a_busy_instrument_is_asked_again(bench: Bench) -> None:
    bench.faults.arm("modbus_exception", value=6, count=2)
    assert bench.registers.get(AIR) == -221
    bench.faults.arm("modbus_exception", value=6)
    with pytest.raises(RefusedRegister, match="the instrument is busy"):
        bench.registers.get(AIR)


def test_a_late_reply_is_not_taken_for_the_next_one(bench: Bench) -> None:
    bench.faults.arm(
        "merge", until_s=ALL_TRIES_S[bench.framing] + 0.1
    )  # held back until after the request was given up
    with pytest.raises(NoReply):
        bench.registers.get(Register(101, "other"))
    bench.faults.arm("lost_reply", count=1)  # so that the late one alone would be there
    bench.clock.sleep(1.0)
    assert bench.registers.get(AIR) == -221


def test_a_late_reply_within_the_tries_is_not_taken_either(bench: Bench) -> None:
    bench.registers.get(AIR)
    bench.faults.arm("merge", until_s=1.05)
    bench.held = 111
    assert bench.registers.get(SETPOINT) == 111
    assert bench.registers.get(AIR) == -221
    assert bench.registers.get(SETPOINT) == 111


class Scripted:
    """Answers with given bytes, whatever is asked; {t} is the transaction number of the request."""

    def __init__(self, *answers: str) -> None:
        self.answers = list(answers)
        self._out = b""

    def receive(self, data: bytes, t_s: float) -> None:
        answer = self.answers.pop(0) if self.answers else ""
        self._out += bytes.fromhex(answer.replace("{t}", data[:2].hex()))

    def transmit(self, t_s: float) -> bytes:
        sent, self._out = self._out, b""
        return sent

    def skip(self, t_s: float) -> None:
        self._out = b""

    def next_byte_s(self, t_s: float) -> float | None:
        return None


GOOD = "{t} 0000 0005 01 03 02 FF23"


@pytest.mark.parametrize(
    ("answer", "error"),
    [
        ("{t} 0000 0007 01 03 04 FF23 0007", MalformedReply),  # two registers instead of one
        ("{t} 0000 0005 01 04 02 FF23", MalformedReply),  # another function
        ("{t} 0000 0005 01 03 02 FF23 55", MalformedReply),  # a byte too many: which of them is the noise?
        ("{t} 0000 0005 02 03 02 FF23", MalformedReply),  # another unit
        ("0063 0000 0005 01 03 02 FF23", MalformedReply),  # another transaction
        ("{t} 0001 0005 01 03 02 FF23", MalformedReply),  # another protocol
        ("{t} 0000 0005 01 03 08 FF23", MalformedReply),  # promises more than it holds
        ("{t} 0000 0006 01 06 0064 FF23", MalformedReply),  # the echo of a write
        ("{t} 0000 0002 01 03", MalformedReply),
        ("{t} 0000 0005 01 03 02", MalformedReply),
        ("", NoReply),
    ],
)
def test_a_reply_that_does_not_fit_is_no_reply(make_bench: Callable[..., Bench], answer: str, error: Any) -> None:
    bench = make_bench("tcp")
    bench.wire = Scripted(*[answer] * 3, GOOD)
    with pytest.raises(error, match=r"chamber: .*air temperature"):
        bench.registers.get(AIR)
    assert bench.registers.get(AIR) == -221
    bench.wire.answers = [answer, GOOD]
    assert bench.registers.get(AIR) == -221


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        ("{t} 0000 0005 02 03 02 FF23", r"unit 2 answered instead of unit 1; set address in the bench file"),
        (
            "0063 0000 0005 01 03 02 FF23",
            r"the reply to request 99 arrived instead of that to request 3; find the second Modbus master",
        ),
        (
            "{t} 0001 0005 01 03 02 FF23",
            r"the reply has protocol number 1 instead of 0 \(Modbus TCP\); check host and tcp_port",
        ),
        (b"HTTP/1.0 400 Bad Request\r\n\r\n".hex(), r"an HTTP server answered, not a Modbus instrument; check host"),
        ("{t} 0000 0005 01 03", r"8 bytes arrived that are not a Modbus reply; check line settings and cable"),
    ],
)
def test_what_came_instead_of_a_reply_is_said_in_one_line(
    make_bench: Callable[..., Bench], answer: str, text: str
) -> None:
    bench = make_bench("tcp")
    bench.wire = Scripted(*[answer] * 3)
    with pytest.raises(
        MalformedReply, match=rf"^chamber: cannot read air temperature \(register 100\), {text}"
    ) as error:
        bench.registers.get(AIR)
    assert len(str(error.value).splitlines()) == 1


def test_of_two_replies_the_one_with_the_requests_number_counts(make_bench: Callable[..., Bench]) -> None:
    bench = make_bench("tcp")
    late = "0000 0005 01 03 02 1111"
    bench.wire = Scripted(GOOD, f"0001 {late} {GOOD}", f"0002 {late} 0001 {late} {GOOD}")
    assert [bench.registers.get(AIR) for _ in range(3)] == [-221, -221, -221]
    assert bench.clock.now_s() == 0.0


@pytest.mark.parametrize("answer", ["{t} 0000 0006 01 06 012C 0001", "{t} 0000 0006 01 06 012D FF23"])
def test_a_write_must_be_echoed(make_bench: Callable[..., Bench], answer: str) -> None:
    bench = make_bench("tcp")
    bench.wire = Scripted(*[answer] * 3)
    with pytest.raises(MalformedReply, match=r"write set point \(register 300\)"):
        bench.registers.put(SETPOINT, -221)


@settings(max_examples=60)
@given(st.sampled_from(["tcp", "rtu"]), st.lists(st.binary(max_size=40), min_size=3, max_size=3))
def test_no_garbage_ever_raises_anything_else(framing: str, answers: list[bytes]) -> None:
    bench = Bench(framing)
    bench.wire = Scripted(*(answer.hex() for answer in answers))
    with contextlib.suppress(InstrumentError):
        bench.registers.get(AIR)
    bench.registers.close()
    assert bench.clock.now_s() < 10 * ALL_TRIES_S[framing]


@settings(max_examples=100)
@given(st.sampled_from(["tcp", "rtu"]), st.binary(max_size=300))
@example("tcp", b"\0\0\0")
@example("tcp", b"\0\0\0\0\0\xff\1\3")
@example("rtu", b"\1\x10\0\0\0\1\xff")
def test_a_simulated_instrument_survives_garbage_too(framing: str, garbage: bytes) -> None:
    bench = Bench(framing)
    bench.device.receive(garbage, 0.0)
    bench.device.transmit(0.0)
    try:
        assert bench.registers.get(AIR) == -221
    finally:
        bench.registers.close()


@pytest.mark.parametrize(("preferred", "known"), [(6, 16), (16, 6), (6, 6), (16, 16)])
def test_the_other_write_function_is_the_fall_back(bench: Bench, preferred: Any, known: int) -> None:
    bench.registers = Registers("chamber", 1, bench.clock, bench.link, write_function=preferred)
    bench.device.functions = frozenset({3, known})
    bench.registers.put(SETPOINT, 300)
    bench.registers.put(SETPOINT, 301)
    assert bench.writes == [300, 301]


def test_a_refused_value_does_not_fall_back(bench: Bench) -> None:
    with pytest.raises(RefusedRegister, match="exception 3, the instrument does not accept the value") as caught:
        bench.registers.put(SETPOINT, 666)
    assert caught.value.code == 3
    assert bench.writes == [666]


@pytest.mark.parametrize("value", [-401, 1501, float("nan")])
def test_what_the_register_does_not_take_is_not_sent(bench: Bench, value: float) -> None:
    with pytest.raises(
        LimitError, match=r"set point \(register 300\) takes -400 to 1500 counts, not .*nothing was sent"
    ):
        bench.registers.put(SETPOINT, value)
    assert bench.clients == []


def test_a_register_to_read_is_not_written(bench: Bench) -> None:
    with pytest.raises(LimitError, match="can only be read"):
        bench.registers.put(AIR, 1)
    assert bench.clients == []


def test_a_value_that_cannot_be_is_named_with_its_range(bench: Bench) -> None:
    with pytest.raises(
        MalformedReply, match=r"air \(register 100\) reads -221 counts, outside the possible range of 0 to 10"
    ):
        bench.registers.get(Register(100, "air", "int16", "counts", low=0, high=10))


@pytest.mark.parametrize("absent", [0, -32000])
def test_an_absent_register_may_also_hold_a_code(bench: Bench, absent: int) -> None:
    missing = Register(999, "missing", "int16")
    with pytest.raises(RefusedRegister, match="exception 2, the instrument has no such register"):
        bench.registers.get(missing)
    bench.device.absent = absent
    assert bench.registers.get(missing) == absent


def test_requests_keep_their_distance_on_the_clock(make_bench: Callable[..., Bench]) -> None:
    bench = make_bench("rtu", pause_s=0.03)
    for _ in range(4):
        bench.registers.get(AIR)
    assert bench.clock.now_s() == pytest.approx(0.09)
    bench.clock.sleep(5.0)
    bench.registers.get(AIR)
    assert bench.clock.now_s() == pytest.approx(5.09)


def test_closing_twice_is_fine_and_the_next_request_opens_again(bench: Bench) -> None:
    bench.registers.close()
    assert bench.registers.get(AIR) == -221
    bench.registers.close()
    bench.registers.close()
    assert bench.registers.get(AIR) == -221


def test_foreign_text_stays_on_one_line() -> None:
    error = LinkError("table", "port x cannot be opened (first line\r\n  second\x00 line);\tcheck the cable")
    assert str(error) == "table: port x cannot be opened (first line second line); check the cable"


def test_a_real_host_that_refuses_is_named() -> None:
    with pytest.raises(LinkError, match=r"chamber: no Modbus TCP instrument answers at 127\.0\.0\.1:1; check address"):
        Ports(VirtualClock()).modbus_tcp("127.0.0.1", 1, device="chamber", timeout_s=1.0)


def test_a_real_port_that_is_not_there_is_named() -> None:
    with pytest.raises(
        LinkError,
        match=r"chamber: port /dev/no-such-port cannot be opened \(No such file or directory\); check the cable",
    ):
        Ports(VirtualClock()).modbus_rtu("/dev/no-such-port", device="chamber", baudrate=9600, timeout_s=1.0)
