"""What a stream format may say; a wrong one is refused with the place, what is there, and what to do."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from instruments.drivers.resolution import resolve
from instruments.protocols.stream_formats.document import StreamFormat, read_format, shipped_formats
from instruments.protocols.stream_formats.frames import FrameDecoder
from labctl.errors import BadBench
from labctl.services.planning.loading import load_bench


def changed(name: str, /, *place: str | int, **values: Any) -> dict[str, Any]:
    """Return a shipped format with values changed at a place."""
    record = read_format(name).model_dump()
    target: Any = record
    for step in place:
        target = target[step]
    target |= values
    return record


WRONG = [
    (changed("serial-csv", line=None), "has one of the sections [line] and [frame]; give exactly one"),
    (changed("serial-csv", "line", "fields", 0, unit="deg"), "field gyro_x: unit 'deg' is not known; choose one of"),
    (changed("serial-csv", "line", "fields", 3, unit="g"), ("unit 'g' does not belong to this "
    "quantity; choose one of deg C, K, deg F")),
    (changed("serial-csv", "line", "fields", 0, unit=None), "field gyro_x has no unit; add one like unit = 'rad/s'"),
    (changed("serial-csv", "line", "fields", 1, name="gyro_x"), "two fields have the name 'gyro_x'"),
    (changed("serial-csv", "line", "fields", 1, name="gyro_w"), "no field is named gyro_x, gyro_y or gyro_z"),
    (changed("kvh-1750", counter={"field": "count", "wrap": 128}), "counter: no field is named 'count'; choose one"),
    (changed("kvh-1750", "frame", sync="FE 8"), ("'FE 8' is not a series of hexadecimal bytes; write "
    "it like 'FE 81 FF 55'")),
    (changed("kvh-1750", "frame", sync=""), "sync is empty; give the bytes with which every frame begins"),
    (changed("kvh-1750", "frame", length=30), ("field accel_z_g ends at byte 28, but the data of a "
    "frame end at byte 26")),
    (changed("kvh-1750", "frame", "checksum", algorithm="crc32/mpeg2"), "checksum 'crc32/mpeg2' is not known"),
    (changed("kvh-1750", "frame", "checksum", algorithm="md5"), ("checksum 'md5' is not known; "
    "choose one of xor8, sum8")),
    (changed("kvh-1750", "frame", "fields", 0, type="f16"), "Input should be 'u8', 'i8'"),
    (changed("kvh-1750", "frame", "fields", 0, item=7), ("field gyro_x has the key `item`, but the "
    "format has no section [frame.items]; leave the key out")),
    (changed("kvh-1750", "frame", "fields", 0, scale_factor=2), "Extra inputs are not permitted"),
    (changed("kvh-1750", format="labctl-stream/2"), "Input should be 'labctl-stream/1'"),
]  # fmt: skip


@pytest.mark.parametrize(("record", "text"), WRONG, ids=[text[:30] for _, text in WRONG])
def test_a_wrong_document_is_refused_with_what_to_correct(record: dict[str, Any], text: str) -> None:
    with pytest.raises(ValidationError) as caught:
        StreamFormat.model_validate(record)
    assert text in caught.value.errors()[0]["msg"]


BENCH = """
name = "own"
[[gyros]]
name = "imu"
driver = "stream-format"
port = "/dev/ttyUSB7"
serial = "IMU-1"
max_rate_dps = 200
format = {format}
{more}
"""


def bench_of(folder: Path, format_: str, more: str = "") -> Any:
    path = folder / "bench.toml"
    path.write_text(BENCH.format(format=format_, more=more), encoding="utf-8")
    return load_bench(str(path))


def test_a_format_is_shipped_or_a_file_beside_the_bench_file_or_in_it(tmp_path: Path) -> None:
    csv = shipped_formats()["serial-csv"].read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(csv.replace("100", "50"), encoding="utf-8")
    shipped = bench_of(tmp_path, '"serial-csv"').gyros[0]
    assert (shipped.sample_rate_hz, shipped.axes, shipped.format.name) == (100, ("x", "y", "z"), "serial CSV")
    beside = bench_of(tmp_path, '"mine.toml"', 'axes = ["z"]')
    assert (beside.gyros[0].sample_rate_hz, beside.gyros[0].axes) == (50, ("z",))
    inside = '{ format = "labctl-stream/1", name = "in", baudrate = 9600, line = { fields = [ { name = "gyro_z", column = 0, unit = "mdeg/s" } ] } }'  # noqa: E501
    assert bench_of(tmp_path, inside, "sample_rate_hz = 5").gyros[0].format.axes == ("z",)
    # what a campaign keeps is whole: it can be resumed where the file is gone
    again = resolve(type(beside).model_validate(beside.model_dump(mode="json")))
    assert again.gyros[0] == beside.gyros[0]


@pytest.mark.parametrize(
    ("format_", "more", "text"),
    [
        ('"vectornav-vnim"', "", "gyros.0.format: Value error, no stream format 'vectornav-vnim' comes with labctl"),
        ('"gone.toml"', "", "gyros.0.format: Value error, the folder of the bench file has no file 'gone.toml'"),
        ('"torn.toml"', "", "torn.toml: Expected '=' after a key"),
        ('"kvh-dsp1760"', 'axes = ["x"]', ("axes = ['x'], but the stream format has the axes ['z']; "
        "correct axes or format")),
        ('"kvh-1750"', "options = { sign = 1 }", "gyros.0.options.sign: Extra inputs are not permitted"),
        ('"kvh-1750"', "sign = 1", "gyros.0.sign: driver stream-format has no such setting"),
        ("7", "", "gyros.0.format: Input should be a valid dictionary"),
    ],
)  # fmt: skip
def test_a_bench_file_with_a_wrong_format_is_refused_with_its_place(
    tmp_path: Path, format_: str, more: str, text: str
) -> None:
    (tmp_path / "torn.toml").write_text("name x", encoding="utf-8")
    with pytest.raises(BadBench) as caught:
        bench_of(tmp_path, format_, more)
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", [name for name in shipped_formats() if name != "serial-csv"])
def test_every_cut_and_every_changed_byte_is_survived(name: str) -> None:
    """The same bytes in pieces of any length are the same readings; a changed byte costs the message that it is in."""
    from instruments.protocols.stream_formats.encoding import message
    from instruments.protocols.stream_formats.lines import LineDecoder

    format_ = read_format(name)
    decoder = LineDecoder if format_.line is not None else FrameDecoder
    field = format_.fields[-2].name
    messages = [message(format_, {"gyro_z": 1000 * n, field: 1, "message": 0x36}) for n in range(12)]
    data = (b"" if format_.line is None else b"\r\n") + b"".join(messages)
    for size in (1, 7, 35, 36, 37, 1000):
        whole = decoder(format_)
        parts = [whole.feed(data[at : at + size]) for at in range(0, len(data), size)]
        found = [value for part in parts for value in part.values["gyro_z"].tolist()]
        assert len(found) == 12, size
        assert sum(part.damaged for part in parts) == 0
    where = data.index(messages[5])
    for at in range(len(messages[5]) - 2):  # but for a line's end
        torn = data[: where + at] + bytes([data[where + at] ^ 0x15]) + data[where + at + 1 :]
        left = decoder(format_).feed(torn)
        assert len(left) == 11, at
        assert left.damaged <= 2 if format_.line is None else left.damaged <= 1


def test_a_float_that_is_no_number_is_no_valid_reading() -> None:
    format_ = StreamFormat.model_validate(
        changed("kvh-1750", "frame", checksum=None) | {"counter": None, "limit_dps": None}
    )
    frame = bytearray.fromhex("FE81FF55" + "7FC00000" + "00" * 20 + "7701001D" + "00" * 4)
    found = FrameDecoder(format_).feed(bytes(frame))
    assert found.valid.tolist() == [False]
    frame[4:8] = bytes.fromhex("7F7FFFFF")  # the largest float
    assert FrameDecoder(format_).feed(bytes(frame)).valid.tolist() == [False]


def test_the_page_lists_the_shipped_formats_and_its_own_one_can_be_used() -> None:
    from instruments.protocols.stream_formats.encoding import message
    from instruments.toml_documents import parse_toml
    from tests.helpers.paths import ROOT

    page = (ROOT / "docs" / "how-to" / "stream-formats.md").read_text(encoding="utf-8")
    rows = {line.split("`")[1]: line.split("|")[-2].strip() for line in page.splitlines() if line.startswith("| `")}
    shipped = {name: read_format(name) for name in shipped_formats()}
    assert rows == {name: f"{each.rate_hz:g} Hz, {each.baudrate}" for name, each in shipped.items()}
    own = StreamFormat.model_validate(parse_toml(page.split("**`my-unit.toml`**\n\n```toml\n")[1].split("```")[0]))
    found = FrameDecoder(own).feed(message(own, {"gyro_z": -1000, "count": 3, "temperature_c": -20500}))
    assert (found.values["gyro_z"].tolist(), found.values["temperature_c"].tolist()) == ([-1000], [-20500])
    assert found.valid.tolist() == [True]
