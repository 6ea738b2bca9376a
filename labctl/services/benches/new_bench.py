"""A new bench file: what was found on the ports and hosts, completed by a person, checked, and written."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import tomli_w
from pydantic import ValidationError

from instruments.bench_config import BenchFile, shipped_benches
from instruments.clock import Clock, SystemClock, WallClock
from instruments.discovery import Found, PortInfo, ask_itself, find_on_host, find_on_port, port_info, serial_ports
from instruments.drivers.resolution import resolve
from labctl.answers.benches import FoundResponse, NewBenchRequest, NewBenchResponse
from labctl.errors import BadInput

MODBUS_PORT = 502
#: Asks a person for a value: section, key, what it is, the proposal; returns what goes into the file, None for none.
Ask = Callable[[str, str, str, object], object]


@dataclass
class Section:
    """One section of the bench file to be."""

    name: str  #: table, chamber, or the gyro's name
    kind: str
    found: Found
    values: dict[str, object] = field(default_factory=dict)


def new_bench(
    file: Path, request: NewBenchRequest, ask: Ask, seen: Callable[[FoundResponse], None], *, force: bool
) -> NewBenchResponse:
    """Find instruments, ask for what they do not say, and write a bench file; `seen` gets each address once searched.

    Raises BadInput where the file exists and `force` is not given, where no gyro answers, and for a value that is
    missing or wrong.
    """
    if file.exists() and not force:
        raise BadInput(f"{file} exists already and was not changed; give another name, or --force to replace the file")
    clock = SystemClock()
    findings, lines = [], []
    for info, each in search(request.ports, request.hosts, clock):
        findings.append((info, each))
        text = each.recognised.text if each.recognised is not None else each.why_not
        lines.append(FoundResponse(address=each.address, kind=each.kind, driver=each.driver, text=text))
        seen(lines[-1])
    sections = sections_of(findings)
    complete(sections, request.settings, clock, ask)
    bench_document = document(request.name, request.latitude_deg, sections)
    write(file, bench_document, sections)
    return NewBenchResponse.model_validate({"file": str(file), "found": lines, "bench": bench_document})


def search(ports: Sequence[str], hosts: Sequence[str], clock: Clock) -> Iterator[tuple[PortInfo | None, Found]]:
    """Yield what is on each port and host; without ports named, on all of this computer. Nothing moves."""
    for info in [port_info(path) for path in ports] or serial_ports():
        yield info, Found(info.path, why_not=info.trouble) if info.trouble else find_on_port(info.path, clock)
    for host in hosts:
        name, _, number = host.partition(":")
        if number and not number.isdigit():
            raise BadInput(f"--host {host}: {number!r} is not a TCP port number; give NAME or NAME:NUMBER")
        yield None, find_on_host(name, int(number or MODBUS_PORT), clock)


def sections_of(recognised: Sequence[tuple[PortInfo | None, Found]]) -> list[Section]:
    """Return the sections of what was recognised: one table, one chamber and the gyros. Raises BadInput."""
    sections: list[Section] = []
    for info, each in recognised:
        if each.recognised is None:
            continue
        if each.kind != "gyro" and (other := next((one for one in sections if one.kind == each.kind), None)):
            raise BadInput(
                f"two {each.kind}s answer, at {other.found.address} and {each.address}, but a bench has only "
                f"one {each.kind}; name the ports of this bench with --port and --host"
            )
        section = Section(_name(each, sections), each.kind, each, dict(each.recognised.settings))
        section.values = {"driver": each.driver, **_address(each, info), **section.values}
        sections.append(section)
    if not any(section.kind == "gyro" for section in sections):
        raise BadInput(
            "no gyro was recognised, and a bench needs one: check power and cables, name the port of the gyro with "
            f"--port, or copy and edit {shipped_benches()['example-real']}"
        )
    return sections


def complete(sections: Sequence[Section], settings: Mapping[str, object], clock: Clock, ask: Ask) -> None:
    """Fill in what instruments say of themselves, what `settings` give (SECTION.KEY) and what a person answers."""
    names = {section.name for section in sections}
    for key in settings:
        if key.rpartition(".")[0] not in names | {""}:
            raise BadInput(f"--set {key}: the bench file has no such section; choose one of {', '.join(sorted(names))}")
    for section in sections:
        for key, value in ask_itself(section.name, section.values, clock).items():
            section.values.setdefault(key, value)
        stated = {
            key.rpartition(".")[2]: value for key, value in settings.items() if key.startswith(f"{section.name}.")
        }
        section.values |= stated
        assert section.found.recognised is not None
        for key, question in section.found.recognised.to_confirm.items():
            if key not in stated and (value := ask(section.name, key, question, section.values.get(key))) is not None:
                section.values[key] = value


def document(name: str, latitude_deg: float | None, sections: Sequence[Section]) -> dict[str, object]:
    """Return the bench file as a document, checked by the models of its drivers. Raises BadInput."""
    bench_document: dict[str, object] = {"name": name}
    if latitude_deg is not None:
        bench_document["latitude_deg"] = latitude_deg
    bench_document |= {section.kind: section.values for section in sections if section.kind != "gyro"}
    bench_document["gyros"] = [
        {"name": section.name, **section.values} for section in sections if section.kind == "gyro"
    ]
    try:
        resolve(BenchFile.model_validate(bench_document))
    except ValidationError as error:
        first = error.errors()[0]
        place_text = ".".join(str(part) for part in first["loc"])
        raise BadInput(
            f"the bench file would not be valid: {place_text}: {first['msg']}; give it with --set SECTION.KEY=VALUE"
        ) from error
    return bench_document


def write(path: Path, made: Mapping[str, object], sections: Sequence[Section]) -> None:
    """Write a bench file; raises BadInput."""
    header = [f"#   {s.name}: {s.found.recognised.text} at {s.found.address}" for s in sections if s.found.recognised]
    head = [f"# Written by `labctl bench new` at {WallClock().utc():%Y-%m-%d %H:%M} UTC. What answered:", *header]
    foot = "# `labctl bench check` asks every instrument; nothing moves. Keys: docs/reference/instruments.md."
    try:
        path.write_text("\n".join([*head, foot, tomli_w.dumps(dict(made))]), encoding="utf-8")
    except OSError as error:
        raise BadInput(f"{path} cannot be written ({error.strerror}); give another name") from error


def parse_setting(text: str) -> tuple[str, object]:
    """Return SECTION.KEY and value of `SECTION.KEY=VALUE`; a value that is not TOML is a text. Raises BadInput."""
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise BadInput(f"--set {text}: give SECTION.KEY=VALUE, such as table.max_rate_dps=100")
    try:
        return key.strip(), tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return key.strip(), value


def _name(recognised: Found, made: Sequence[Section]) -> str:
    if recognised.kind != "gyro":
        return recognised.kind
    same = sum(section.found.driver == recognised.driver for section in made)
    return f"{recognised.driver}-{same + 1}" if same else recognised.driver


def _address(recognised: Found, info: PortInfo | None) -> dict[str, object]:
    if info is not None:
        return {"port": info.path, **({"adapter": info.adapter} if info.adapter else {})}
    host, _, number = recognised.address.rpartition(":")
    return {"host": host, **({} if int(number) == MODBUS_PORT else {"tcp_port": int(number)})}
