"""Replaying a wire log: the same session again, on the recorded instruments, in virtual time."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import datetime
from importlib.metadata import version
from pathlib import Path

from instruments.bench_config import BenchFile
from instruments.clock import VirtualClock
from instruments.errors import InstrumentError, one_line
from instruments.transport.wire_log.document import WireLogError
from instruments.transport.wire_log.record import WireRecord
from instruments.transport.wire_log.replay import Difference, Replay
from instruments.transport.wire_log.replayed_links import ReplayedWire
from labctl.answers.wire_logs import ReadingsDigest, RecordedSession, ReplayResponse, SessionResult
from labctl.errors import BadBench, BadInput, LabctlError
from labctl.services.benches.check import check_on_wire, said_of
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.services.campaigns.readings_digest import readings_digest
from labctl.services.campaigns.recorded_operator import ReplayedOperator
from labctl.services.planning.loading import with_drivers
from labctl.store import Store, open_store
from procedures.contracts.control import Control
from procedures.contracts.errors import ProcedureError


@dataclass
class Session:
    """A recorded session that is being replayed, and its result."""

    bench: BenchFile
    what: RecordedSession  #: as the header says it
    replay: Replay
    result: SessionResult = field(default_factory=SessionResult)  #: of the replay


def replay(path: Path, database: str | None = None) -> ReplayResponse:
    """Replay a wire log; a campaign is kept in `database`, or nowhere. Raises BadInput for a file that is none."""
    try:
        session = _opened(path)
        begun_s = session.replay.clock.now_s()
        if session.what.kind == "campaign":
            with _store(database) as store:
                _run_campaign(store, session)
        else:
            _check_bench(session)
        session.replay.record.read_to_end()
    except WireLogError as error:
        raise BadInput(str(error)) from error
    except OSError as error:
        raise BadInput(
            f"{path} cannot be read ({error.strerror or error}); give a file that --wire-log wrote"
        ) from error
    return _response(path, session, begun_s)


def _opened(path: Path) -> Session:
    """Return the session of a file, ready to begin. Raises WireLogError, OSError, BadInput."""
    record = WireRecord(path)
    header = record.header
    try:
        recorded_session = RecordedSession.model_validate(header["session"])
        if not recorded_session.can_be_replayed:
            raise BadInput(
                f"{path} is the log of a session of kind {recorded_session.kind!r}, which depends on more than its "
                "bytes, so it "
                f"cannot be replayed; read it with `zcat {path}`"
            )
        bench = with_drivers(BenchFile.model_validate(header["bench"]))
        start, now_s = datetime.fromisoformat(str(header["clock_start"])), float(str(header["now_s"]))
        clock = VirtualClock(start, now_s=now_s)
    except (KeyError, ValueError, BadBench) as error:
        raise BadInput(
            f"{path}: its header is not one of labctl {version('labctl')} ({one_line(error)}); install labctl "
            f"{header.get('labctl', 'of that time')} to replay it"
        ) from error
    return Session(bench, recorded_session, Replay(record, clock))


@contextmanager
def _store(database: str | None) -> Iterator[Store]:
    if database is not None:
        with open_store(database, write=True) as store:
            yield store
        return
    with (
        tempfile.TemporaryDirectory(prefix="labctl-replay-") as folder,
        open_store(str(Path(folder) / "replay.sqlite"), write=True) as store,
    ):
        yield store


def _run_campaign(store: Store, session: Session) -> None:
    control, recorded_session, wire = Control(), session.what, ReplayedWire(session.replay)

    def end(difference: Difference) -> None:
        control.abort(difference.text)

    session.replay.on_over = end
    try:
        prepared = prepare(
            store, recorded_session.recipe, session.bench, session.replay.clock, clip=recorded_session.clip,
            fit=recorded_session.fit, wire=wire
        )  # fmt: skip
        if session.bench.needs_person:
            prepared = replace(prepared, operator=ReplayedOperator(session.replay))
        answer = run(store, prepared, control)
    except (LabctlError, InstrumentError, ProcedureError) as error:
        session.result.ended_by = f"{type(error).__name__}: {error}"
        return
    session.result.state, session.result.readings = answer.state.value, readings_digest(store, answer.id)


def _check_bench(session: Session) -> None:
    reports = check_on_wire(session.bench, session.replay.clock, ReplayedWire(session.replay))
    session.result.said = said_of(reports)


def _response(path: Path, session: Session, begun_s: float) -> ReplayResponse:
    record, difference = session.replay.record, session.replay.difference
    remarks, ok, recorded = list[str](), difference is None or difference.is_end, SessionResult()
    if record.result is not None:
        recorded = SessionResult.model_validate(record.result)
        remarks += _different(session, recorded)
        ok = ok and not remarks
    if difference is not None and recorded.ended_by:
        remarks.append(f"the session was ended by {recorded.ended_by}; what a person asked for is not in the log")
    if recorded.left_out:
        remarks.append(f"{recorded.left_out} events are not in the log: the disk was too slow")
    return ReplayResponse(
        file=str(path), ok=ok, session=session.what.kind, labctl=str(record.header.get("labctl", "")),
        bench=session.bench.name, duration_s=record.last_s - begun_s, requests=session.replay.requests,
        whole=record.result is not None, difference="" if difference is None else difference.text,
        recorded=recorded.readings, found=session.result.readings, remarks=remarks,
    )  # fmt: skip


def _different(session: Session, recorded: SessionResult) -> list[str]:
    """Return what of the result differs from the session."""
    result, differences = session.result, []
    if left := session.replay.not_sent():
        differences.append("requests that the session made and this replay did not: " + ", ".join(left))
    pairs = {
        "state of the campaign": (recorded.state, result.state),
        "end": (recorded.ended_by, result.ended_by),
        "readings": (_readings(recorded.readings), _readings(result.readings)),
    }
    differences += [
        f"{name}: {was} in the session, {now} in this replay" for name, (was, now) in pairs.items() if was != now
    ]
    return differences + [f"said only by this replay: {line}" for line in result.said if line not in recorded.said]


def _readings(digest: ReadingsDigest | None) -> str:
    if digest is None:
        return "none"
    return f"{digest.readings} in {digest.datasets} data sets, SHA-256 {digest.sha256}"
