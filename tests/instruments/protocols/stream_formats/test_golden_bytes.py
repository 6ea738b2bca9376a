"""Shipped stream formats against bytes that others have published: manuals, and recordings in public repositories.

The numbers beside the bytes are the publishers' own. No simulator has a part in this file.
"""

from __future__ import annotations

import math

import pytest

from instruments.protocols.stream_formats.document import StreamFormat, read_format
from instruments.protocols.stream_formats.frames import FrameDecoder
from instruments.protocols.stream_formats.lines import LineDecoder
from instruments.protocols.stream_formats.readings import Decoded, scale_of, stamp_ticks

G = 9.80665
DEG = 180.0 / math.pi


def values(format_: StreamFormat, found: Decoded) -> dict[str, list[float]]:
    """Return channel -> values in its unit."""
    channels = {}
    for field in format_.fields:
        if field.unit is not None:
            scale = scale_of(field, format_.rate_hz or 1.0)
            channels[field.name] = (scale.offset + scale.scale * found.values[field.name]).tolist()
    return channels


def framed(name: str, *hexadecimal: str) -> tuple[Decoded, dict[str, list[float]]]:
    format_ = read_format(name)
    found = FrameDecoder(format_).feed(b"".join(bytes.fromhex(each) for each in hexadecimal))
    return found, values(format_, found)


# TRECVT/ros_kvh1750, test/utest.cpp: recorded messages "early" (gyros not valid, sequence 31, 29 deg C), "basic" (all
# valid, sequence 104, 29 deg C) and "bad_crc"
EARLY = "FE81FF55 3B041F78 B9B96613 BA234B38 BB7C0410 B8DEF480 3F7F4B7B 701F 001D F12FB6EE"
BASIC = "FE81FF55 B3D0BBE7 32193EF4 30AC19A5 BA8F78D6 3A290594 3F7ECBD4 7768 001D ADC5F651"
BAD_CRC = "FE81FF55 B46B86C6 B44F5B83 B4106D09 BB713CB7 BBABD914 3F7E319A 7769 001D 95BBDB4F"
# wpi kvh_driver, test/kvhtest.cpp: the example of the KVH manual, whose CRC it gives as 4BFA34D8
MANUAL = "FE81FF55 37A96A6E 38586C1F B75BF862 BF803E78 BB650D28 3B0A37AC 773D 0028 4BFA34D8"


def test_kvh_1750_messages_of_the_manual_and_of_a_recording() -> None:
    found, channels = framed("kvh-1750", MANUAL, EARLY, BASIC, BAD_CRC, MANUAL)
    assert found.valid.tolist() == [True, False, True, True]
    assert found.values["sequence"].tolist() == [0x3D, 31, 104, 0x3D]
    assert channels["temperature_c"] == [40, 29, 29, 40]
    assert found.damaged == 1
    # IEEE 754 by hand: 37A96A6E is 2.0196e-05
    assert channels["gyro_x"][0] == pytest.approx(2.01959e-05 * DEG, rel=1e-5)
    assert channels["accel_x_g"][0] == pytest.approx(-1.00190, abs=1e-5)
    assert channels["accel_z_g"][2] == pytest.approx(0.99530, abs=1e-5)


def test_kvh_dsp1760_takes_the_z_rate_of_the_same_message() -> None:
    found, channels = framed("kvh-dsp1760", MANUAL)
    assert found.valid.tolist() == [True]
    assert channels["gyro_z"] == pytest.approx([-1.31111e-05 * DEG], rel=1e-4)
    assert "gyro_x" not in channels


# Scottapotamas/xsens-mti, docs/mtmanager_packets.md (examples 4, 5 and 6) and test_xsens_mti_parse_messages.c:
# packets of an MTi-300, decoded by the maker's MT Manager
XSENS_4 = """FAFF3692
10 20 02 91 8D 10 60 04 01 36 3F A6 20 10 10 3F 35 E0 42 3F 31 CD 15 BD 9F 49 DB BD A9 38 CF 40 20 0C BD 63 5A 90
41 1D 08 D4 3E 5F AA 50 40 10 0C B9 11 68 00 3C C9 01 00 3A 0F 7D 00 40 30 0C BC 3B 29 80 3C 35 FC 00 3C A4 6E 00
80 20 0C 3C AE A2 41 BB 56 D8 00 BA D5 AC 01 80 30 10 3F 80 00 00 37 DF 88 01 B6 89 80 00 B6 08 C0 00 C0 20 0C BE
FB FB F2 3F 33 C4 85 BF A0 A2 C1 08 10 04 42 16 80 00 30 10 04 00 01 86 E1 E0 20 04 00 40 00 03 DD"""
#: measured during a shake, the Y rate out of range: no temperature in it
XSENS_5 = """
10 20 02 FB 85 10 60 04 01 A4 98 DE 20 10 10 3F 2A 14 63 BE D7 EF A7 3C DE E5 08 3F 1D CE C9 40 20 0C C1 F2 46 C3
C1 EC E0 76 C2 8F 85 3F 40 10 0C BD 93 2C CC BD 92 0A 16 BE 3A 6E EC 40 30 0C 42 51 94 64 C2 7B 5A 5A C1 CC C0 AE
80 20 0C 40 85 4D 6D C1 25 55 9E C0 90 8E 1F 80 30 10 3F 7F F8 98 3B AA 9E E5 BC 53 9E C0 BB B9 06 0C C0 20 0C 3E
DC 74 39 BE 75 2B 48 3F AF 9A 3F 30 10 04 00 01 86 DE E0 20 04 00 48 14 01"""
#: orientation only: no reading of a gyro
XSENS_6 = """10 20 02 46 82 10 60 04 01 C4 FC 3E 20 10 10 3F 71 CE 6C BE A5 6B CF 3C 61 3B D8 BD 69 1D 25
E0 20 04 00 40 00 03"""
GO_TO_CONFIG_ACK = "FA FF 31 00 D0"


def xbus(data: str) -> str:
    """Return data published without their envelope as a whole message: the sum of all bytes but the first is 0."""
    body = bytes.fromhex(data)
    covered = bytes([0xFF, 0x36, len(body)]) + body
    return (b"\xfa" + covered + bytes([-sum(covered) & 0xFF])).hex()


def test_xsens_packets_as_mt_manager_decodes_them() -> None:
    found, channels = framed("xsens-mti", XSENS_4, GO_TO_CONFIG_ACK, xbus(XSENS_6), xbus(XSENS_5))
    assert found.values["packet_counter"].tolist() == [37261, 64389]
    assert found.damaged == 0  # other messages are none
    rates = [[channels[f"gyro_{axis}"][row] / DEG for axis in "xyz"] for row in (0, 1)]
    assert rates[0] == pytest.approx([0.02131760, -0.00327826, -0.00163019], abs=5e-9)
    assert rates[1] == pytest.approx([4.16570139, -10.33340263, -4.51734877], abs=5e-7)
    assert [channels[f"accel_{axis}_g"][0] * G for axis in "xyz"] == pytest.approx(
        [-0.05550629, 9.81465530, 0.21842313], abs=5e-7
    )
    assert channels["temperature_c"] == [37.625, 37.625]  # sent more rarely: the last one stands
    assert channels["status"] == [0x00400003, 0x00481401]
    assert found.valid.tolist() == [True, False]  # bit 12: rate about Y out of range (MT0605P, page 48)


def test_the_same_packets_have_the_time_of_the_unit() -> None:
    """SampleTimeFine of the first is 0x01363FA6 ticks of 0.1 ms: 2033.2454 s after it was switched on."""
    found, channels = framed("xsens-mti-timed", XSENS_4, xbus(XSENS_6), xbus(XSENS_5))
    assert found.values["sample_time_fine"].tolist() == [0x01363FA6, 0x01A498DE]
    ticks = stamp_ticks(read_format("xsens-mti-timed"))
    assert ticks is not None
    assert found.values["sample_time_fine"][0] * ticks.tick_s == pytest.approx(2033.2454)
    assert ticks.wrap == 2**32
    assert channels == framed("xsens-mti", XSENS_4, xbus(XSENS_6), xbus(XSENS_5))[1]


def test_vectornav_lines_of_real_units() -> None:
    """Lines that stand as examples in public drivers: sbruder's VN200 scripts, and four ROS drivers of the VN-100."""
    lines = LineDecoder(read_format("vectornav-vnimu"))
    found = lines.feed(
        b"rest of a line\r\n"
        b"$VNIMU,-00.0350,+00.4222,-00.6643,-00.015,+00.019,+09.948,+00.002066,-00.008442,-00.044656,+20.7,+084.322*66\r\n"
    )
    assert [int(found.values[f"gyro_{axis}"][0]) for axis in "xyz"] == [2066, -8442, -44656]  # the digits of the line
    channels = values(read_format("vectornav-vnimu"), found)
    assert channels["gyro_z"] == pytest.approx([-0.044656 * DEG])
    assert channels["accel_z_g"] == pytest.approx([9.948 / G])
    assert channels["temperature_c"] == pytest.approx([20.7])

    lines = LineDecoder(read_format("vectornav-vnymr"))
    found = lines.feed(
        b"\r\n$VNYMR,-078.104,+005.642,+023.096,+00.0125,+00.1252,-00.1042,+00.878,-03.762,-08.854,-00.010387,-00.028062,"
        b"-00.061305*68\r\n$VNRRG,01,VN-200T-CR*31\r\n"  # an answer of the unit is another message
        b"$VNYMR,+100.949,-007.330,+000.715,-00.0049,-00.2449,+00.5397,-01.258,-00.100,-09.701,-00.000018,+00.001122,"
        b"-00.000551*69\r\n$VNYMR,-004.328,+001.357,+178.257,+00.2219,-00.0720,+00.4652,+00.226,-00.321,+10.043,"
        b"-00.001188,+00.001866,-00.007661*6C\r\n"
        b"$VNYMR,-004.328,+001.357,+178.257,+00.2219,-00.0720,+00.4652,+00.226,-00.321,+10.043,"
        b"-00.001188,+00.001866,-00.007662*6C\r\n"  # one digit changed
    )
    assert found.values["gyro_z"].tolist() == [-61305, -551, -7661]
    assert found.damaged == 1


def test_vectornav_time_behind_a_message() -> None:
    """UM001, page 69: $VNYPR with a time appended; the letter tells it from the status, which has an S."""
    record = read_format("vectornav-vnimu-sync").model_dump()
    names = ["gyro_x", "gyro_y", "gyro_z"]
    fields = [{"name": name, "column": 1 + k, "unit": "deg/s", "resolution": 0.001} for k, name in enumerate(names)]
    fields.append({**record["line"]["fields"][-1], "column": 4})
    record["line"] |= {"begins": "$VNYPR,", "columns": 5, "fields": fields}
    lines = LineDecoder(StreamFormat.model_validate(record))
    found = lines.feed(
        b"\r\n$VNYPR,+010.071,+000.278,-002.026,T1162704*2F\r\n$VNYPR,+010.071,+000.278,-002.026,S0000*1F\r\n"
    )
    assert found.values["time_sync_in"].tolist() == [1162704]
    assert found.values["gyro_x"].tolist() == [10071]
    assert found.damaged == 1


def test_vectornav_synchronised_messages_have_the_fields_of_the_manual() -> None:
    """UM001: VNIMU (register 54) has 11 values, then the appended one; bits 0, 2, 13 of group 1 are times, pulses."""
    plain, timed = read_format("vectornav-vnimu").line, read_format("vectornav-vnimu-sync").line
    assert plain is not None
    assert timed is not None
    assert timed.fields[:-1] == plain.fields
    assert (timed.columns, timed.fields[-1].column, timed.fields[-1].prefix) == (1 + 11 + 1, 12, "T")
    for name, group_1, size in (("sync", 1 << 0 | 1 << 2, 8 + 8), ("count", 1 << 0 | 1 << 13, 8 + 4)):
        frame = read_format(f"vectornav-binary-{name}").frame
        assert frame is not None
        sync = bytes.fromhex(frame.sync)
        assert sync[:2] == bytes([0xFA, 1 << 0 | 1 << 2])
        assert int.from_bytes(sync[2:4], "little") == group_1
        assert frame.length == len(sync) + size + 12 + 12 + 4 + 2


# VN-100 manual UM001, pages 39 and 40: binary output packets and the numbers in them. The CRC printed for the second
# fits none of the CRCs of its bytes, nor with the mask that its fields ought to have; its numbers are what is compared.
YAW_PITCH_ROLL = "FA01080093502E42833EF13F48B504BB9288"
WITH_TEMPERATURE = "FA0508000100A41502424DDFEB3FF61A36BEBF2DA441A83A"
MANUAL_PACKETS = [(YAW_PITCH_ROLL, 4, 18, 0), (WITH_TEMPERATURE, 6, 24, 18)]


@pytest.mark.parametrize(("packet", "at", "length", "temperature_at"), MANUAL_PACKETS)
def test_vectornav_packets_of_the_manual(packet: str, at: int, length: int, temperature_at: int) -> None:
    """Their data are angles, so a format of this test reads them; envelope, CRC and floats are the shipped format's."""
    shipped = read_format("vectornav-binary")
    record = shipped.model_dump()
    record["frame"] |= {"sync": packet[: 2 * at], "length": length}
    names = ["gyro_x", "gyro_y", "gyro_z"]
    fields = [{"name": n, "at": at + 4 * i, "type": "f32", "unit": "deg/s"} for i, n in enumerate(names)]
    if temperature_at:
        fields.append({"name": "temperature_c", "at": temperature_at, "type": "f32", "unit": "deg C"})
    record["frame"]["fields"] = fields
    if temperature_at:
        record["frame"] |= {"checksum": None, "trailer": packet[-4:]}
    format_ = StreamFormat.model_validate(record)
    found = FrameDecoder(format_).feed(bytes.fromhex(packet))
    channels = values(format_, found)
    expected = [43.578686, 1.8847202, -2.0249654e-3] if not temperature_at else [32.521133, 1.8427521, -0.17783722]
    assert [channels[name][0] for name in names] == pytest.approx(expected, rel=1e-7)
    if temperature_at:
        assert channels["temperature_c"] == pytest.approx([20.522337], rel=1e-7)


def test_vectornav_binary_header_says_what_its_fields_are() -> None:
    """UM001, pages 35 and 39: of group 3 bits 2, 3, 4 are UncompAccel, UncompGyro, Temp; of 12, 12 and 4 bytes."""
    frame = read_format("vectornav-binary").frame
    assert frame is not None
    sync = bytes.fromhex(frame.sync)
    assert (sync[1], int.from_bytes(sync[2:], "little")) == (1 << 2, 1 << 2 | 1 << 3 | 1 << 4)
    assert frame.length == len(sync) + 12 + 12 + 4 + 2
    assert {f.name: f.at for f in frame.fields if f.name.endswith(("x", "c", "x_g"))} == {
        "accel_x_g": 4, "gyro_x": 16, "temperature_c": 28,
    }  # fmt: skip
