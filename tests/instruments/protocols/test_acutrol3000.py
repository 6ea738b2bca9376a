"""Messages and replies of the ACUTROL 3000 as its manuals print them: TM-8004-C (page) and TM-9374A page 34."""

from __future__ import annotations

import pytest

from instruments.protocols.acutrol3000 import commands as acl
from instruments.protocols.acutrol3000.messages import Command, ParseError, commands_of

#: Printed example -> what it means; the page is that of TM-8004-C.
PRINTED = [
    (":Demand:Position 3,10.5", [("demand:position", "3", "10.5")]),  # page 2
    (":Dem:Pos 3,10.50000", [("demand:position", "3", "10.50000")]),
    (":D:P 3,10.5", [("demand:position", "3", "10.5")]),
    (":Mode:Position 1;Rate 2", [("mode:position", "1"), ("mode:rate", "2")]),  # page 3
    (":Demand:Pos 2,0.01;Rate 3,100", [("demand:position", "2", "0.01"), ("demand:rate", "3", "100")]),  # page 4
    (
        ":Dem:Pos 2,0.01;:Mode:Pos 2;Rate 1",
        [("demand:position", "2", "0.01"), ("mode:position", "2"), ("mode:rate", "1")],
    ),
    ("*IDN?", [("*idn?",)]),  # page 15
    (":DEM:RATE 2,100.0", [("demand:rate", "2", "100.0")]),  # page 113
    (":DEM:RATE? 2;RATE? 1", [("demand:rate?", "2"), ("demand:rate?", "1")]),
    (":INT:CLOSe 1", [("interlock:close", "1")]),  # page 131
    (":I:C 1;C 2", [("interlock:close", "1"), ("interlock:close", "2")]),
    (":INT:RES;CLOS 1", [("interlock:reset",), ("interlock:close", "1")]),  # page 136
    (":LIM:ACC P,1,1500.0", [("limit:acceleration", "P", "1", "1500.0")]),  # page 139
    (":LIM:RATE? P,3", [("limit:rate?", "P", "3")]),  # page 145
    (":MODE? 2", [("mode?", "2")]),  # page 147
    (":MODE:OFF 1", [("mode:off", "1")]),  # page 150
    (":R:R? 2;P? 1", [("read:rate?", "2"), ("read:position?", "1")]),  # page 169
    (":Status:ESR? A1Dyn,2", [("status:esr?", "A1Dyn", "2")]),  # page 177
]


@pytest.mark.parametrize(("message", "meant"), PRINTED)
def test_printed_messages_mean_what_the_manual_says(message: str, meant: list[tuple[str, ...]]) -> None:
    assert list(commands_of(message)) == [Command(path, tuple(arguments)) for path, *arguments in meant]


@pytest.mark.parametrize("message", [":Demand:Posn 3,10.5", ":Dem;Pos 3,10.50000", ":D:P,3,10.5"])
def test_printed_mistakes_are_mistakes(message: str) -> None:
    """Page 2: spelling, misuse of a semicolon, a comma between command and arguments."""
    with pytest.raises(ParseError):
        [command.value(1) for command in commands_of(message)]


def test_what_is_sent_has_the_printed_form() -> None:
    assert acl.demand_rate(1, -45.0) == ":Demand:Rate 1,-45.00000;:Mode:Rate 1"
    assert acl.demand_position(2, 0.0) == ":Demand:Position 2,0.00000;:Mode:Position 2"
    assert acl.off(1) == ":Mode:Off 1"
    assert acl.limit_acceleration("R", 1, 100.0) == ":Limit:Acceleration R,1,100.00000"
    assert acl.register("A1DYN") == ":Status:CSR? A1DYN"


@pytest.mark.parametrize(
    ("head", "found"),
    [
        ("00000000 02000000", acl.Head(0, 2)),  # low byte first
        ("00000000 00000002", acl.Head(0, 2)),  # high byte first
        ("d7000000 00010000", acl.Head(215, 256)),  # 215 is printed in the release notes
        ("000000d7 00000000", acl.Head(215, 0)),
        ("00000000 00800000", acl.Head(0, 32_768)),  # the longest, page 5
    ],
)
def test_error_word_and_length_in_either_byte_order(head: str, found: acl.Head) -> None:
    """TM-9374A page 34: the first 32-bit word is the error, the second the number of characters."""
    data = bytes.fromhex(head)
    assert acl.is_headed(data)
    assert acl.head_of(data) == found


def test_a_line_of_text_is_no_head() -> None:
    assert not acl.is_headed(b"Acutronic R&D USA,Acutrol3000,0,A8800-001-01.000-a\r\n")
    with pytest.raises(ValueError, match="no error code and length"):
        acl.head_of(b"Acutroni")


def test_status_bits_have_the_names_of_the_manual() -> None:
    """Pages 213 and 214."""
    assert acl.named_bits(1 << 9 | 1 << 6, acl.INTERLOCKS) == ["power amplifier acknowledge", "master interlock"]
    assert acl.named_bits(1 << 1 | 1 << 2, acl.SOFTWARE_FAULTS) == ["rate trip", "position tracking error"]
    assert (len(acl.INTERLOCKS), len(acl.SOFTWARE_FAULTS)) == (16, 10)
