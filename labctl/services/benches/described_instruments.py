"""Descriptions of instruments (`labctl-lines/1`): a file is checked, and its requests tried on an address."""

from __future__ import annotations

import os
import tempfile
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

from pydantic import ValidationError

from instruments.clock import Clock, SystemClock
from instruments.conformance.described import Described, requests_of, try_description
from instruments.protocols.request_reply.chamber import ChamberDescription
from instruments.protocols.request_reply.reference import ReferenceDescription
from instruments.protocols.request_reply.settings import shipped_descriptions
from instruments.protocols.request_reply.table import TableDescription
from instruments.toml_documents import listed, read_toml, shown
from labctl.answers.admin import DescribedCheckResponse, DescriptionTestResponse
from labctl.answers.wire_logs import RecordedSession
from labctl.errors import BadInput
from labctl.services.benches.wire_log import recording

MODELS: dict[str, type[Described]] = {
    "table": TableDescription, "chamber": ChamberDescription, "reference": ReferenceDescription
}  # fmt: skip


def read_description(source: str) -> Described:
    """Return a description by path, or a shipped one by name; raises BadInput naming the file, the place and the value.

    Every mistake that was found is named.
    """
    path = shipped_descriptions().get(source, Path(source))
    try:
        document = read_toml(path)
    except FileNotFoundError:
        names = ", ".join(shipped_descriptions())
        raise BadInput(
            f"{source!r} is neither a file nor a description that ships with labctl; name a file, or one of {names}"
        ) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, IsADirectoryError) as error:
        raise BadInput(f"description {source}: not TOML: {error}; correct it") from error
    kind = document.get("kind")
    if not isinstance(kind, str) or kind not in MODELS:
        raise BadInput(
            f"description {source}: kind: is {shown(kind)}, but it must say what is described: choose one of "
            f"{', '.join(MODELS)}"
        )
    try:
        return MODELS[kind].model_validate(document)
    except ValidationError as error:
        complaints = listed(_complaint(one["loc"], one["msg"], one["type"], one["input"]) for one in error.errors())
        raise BadInput(f"description {source}: {complaints}; correct the file") from error


def check_description(
    source: str,
    port: str | None,
    host: str | None,
    done: Callable[[DescribedCheckResponse], None] | None = None,
    *,
    move: bool = False,
    clock: Clock | None = None,
    wire_log: Path | None = None,
) -> DescriptionTestResponse:
    """Check a description, and try it on a serial port or on a host (HOST:PORT); `done` is called after each request.

    Without an address nothing is sent, and the answer lists the requests. `move` also sends the commands;
    `wire_log` is the file that gets every byte; without it, a file in the folder for temporary files is kept where a
    request failed. Raises BadInput for a description or an address that is none.
    """
    description = read_description(source)
    address = _address(port, host)
    checks: list[DescribedCheckResponse] = []
    if address is None and move:
        raise BadInput("--move needs an instrument to move; add --port or --host")
    if address is None and wire_log is not None:
        raise BadInput(f"--wire-log {wire_log}: nothing is sent without an instrument; add --port or --host")
    is_own = address is not None and wire_log is None
    file = _temporary_log() if is_own else wire_log
    keep = False
    try:
        for each in _found(description, address, clock or SystemClock(), move=move, wire_log=file):
            checks.append(each)
            if done is not None:
                done(each)
        keep = any(check.problem for check in checks)
    except ValidationError as error:
        raise BadInput(f"description {source}: {error.errors()[0]['msg']}; correct the address or the file") from error
    finally:
        if is_own and file is not None and not keep:
            file.unlink(missing_ok=True)
            file = None
    return DescriptionTestResponse(
        file=source, name=description.name, kind=description.kind, address=port or host,
        ok=not any(check.problem for check in checks), checks=checks, wire_log=None if file is None else str(file),
    )  # fmt: skip


def _temporary_log() -> Path | None:
    """Return a new file for a wire log; None where there is no place for one, which is no reason to try nothing."""
    try:
        handle, name = tempfile.mkstemp(prefix="labctl-driver-test-", suffix=".jsonl.gz")
    except OSError:
        return None
    os.close(handle)
    return Path(name)


def _found(
    description: Described, address: dict[str, object] | None, clock: Clock, *, move: bool, wire_log: Path | None
) -> Iterator[DescribedCheckResponse]:
    """Yield the requests of a description, and what came of each where there is an address."""
    if address is None:
        yield from (DescribedCheckResponse(what=key, answer=text) for key, text in requests_of(description))
        return
    document = description.model_dump(mode="json", exclude_unset=True)
    with recording(wire_log, None, clock, RecordedSession(kind="driver test", description=document)) as log:
        wire = None if log is None else log.wire
        for each in try_description(description, address, clock, move=move, wire=wire):
            yield DescribedCheckResponse(what=each.what, answer=each.answer, problem=each.problem)


def _complaint(place: tuple[str | int, ...], message: str, kind: str, document: object) -> str:
    place_text = ".".join(str(part) for part in place) or "the whole file"
    value = "" if kind == "missing" or not place else f" (is {shown(document)})"
    return f"{place_text}: {message.removeprefix('Value error, ')}{value}"


def _address(port: str | None, host: str | None) -> dict[str, object] | None:
    """Return the address as a bench file gives it; raises BadInput."""
    if port is not None and host is not None:
        raise BadInput(f"both --port {port} and --host {host} are given; keep one of the two")
    if host is None:
        return None if port is None else {"port": port}
    name, _, number = host.rpartition(":")
    if not name or not number.isdecimal() or not 0 < int(number) <= 65535:
        raise BadInput(f"--host {host!r} is not HOST:PORT with a port from 1 to 65535; write it like 192.168.0.7:5025")
    return {"host": name, "tcp_port": int(number)}
