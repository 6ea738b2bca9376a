"""Checks in one snapshot that a database holds what was written to it: file, schema, readings, calibrations, audit."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace

import numpy as np
import sqlalchemy as sa
from numpy.typing import NDArray
from sqlalchemy import exc

from labctl.errors import BadCalibrationFile, StoreError
from labctl.public_keys import PublicKey
from labctl.store import migrate, sample_codec
from labctl.store.connection.anchor_file import anchor_path, read_anchor
from labctl.store.connection.commit_seal import missing
from labctl.store.connection.database import Database
from labctl.store.connection.location import is_url, shown
from labctl.store.import_parts import WHOLE_TABLE
from labctl.store.integrity.check_manifests import ManifestCheck
from labctl.store.integrity.check_means import MeansCheck
from labctl.store.manifests.chain import ChainHead
from labctl.store.manifests.digests import block_digests
from labctl.store.manifests.parts import BlockParts, Parts
from labctl.store.repositories.audit import Head, first_broken
from labctl.store.schema import tables

#: Blocks that are in memory at a time.
AT_ONCE = 64

Progress = Callable[[str, int, int], None]  #: which part, how far, of how many


@dataclass(frozen=True)
class Finding:
    """Damage that was found: in which part, and what."""

    part: str
    text: str


@dataclass(frozen=True)
class Checked:
    """What was checked, and what was found."""

    findings: tuple[Finding, ...]
    blocks: int
    calibrations: int
    audit_rows: int
    manifests: int = 0
    not_sealed: int = 0  #: records that are still changing
    signed: int = 0  #: manifests that the last signature covers: verified where a key was given
    keys: tuple[str, ...] = ()  #: fingerprints of the keys that signatures name
    head: ChainHead | None = None  #: end of the chain, to be noted down elsewhere
    remarks: tuple[str, ...] = ()  #: what was not checked, and why


def _no_progress(_part: str, _done: int, _total: int) -> None:
    pass


def check(
    location: str,
    *,
    anchor: Head | None = None,
    chain_anchor: ChainHead | None = None,
    keys: Sequence[PublicKey] = (),
    progress: Progress | None = None,
) -> Checked:
    """Check a database by path or URL. Raises StoreError when there is none.

    `anchor` is a head of the audit trail, `chain_anchor` one of the manifests, that were noted down elsewhere. With
    `keys` every signature by them is verified, and every manifest has to be covered by one.
    """
    run = _Check(location, anchor, progress or _no_progress)
    run.chain_anchor, run.keys = chain_anchor, keys
    with closing(Database(location, write=False, as_it_is=True)) as database:
        try:
            with database.reading() as connection:
                run.all_parts(connection)
        except StoreError as error:  # a damaged file need not answer any query
            run.find("file", str(error))
    return run.result()


class _Check:
    """One check of a database, part by part."""

    def __init__(self, location: str, anchor: Head | None, progress: Progress) -> None:
        self._location = location
        self._anchor = anchor
        self._progress = progress
        self.findings: list[Finding] = []
        self.blocks = self.calibrations = self.audit_rows = 0
        self.chain_anchor: ChainHead | None = None
        self.keys: Sequence[PublicKey] = ()
        self._manifests: ManifestCheck | None = None
        self._block_parts: dict[int, BlockParts | None] = {}
        self._remarks: list[str] = []

    def result(self) -> Checked:
        """Return what was found so far."""
        checked = Checked(tuple(self.findings), self.blocks, self.calibrations, self.audit_rows)
        if self._manifests is None:
            return replace(checked, remarks=tuple(self._remarks))
        chain = self._manifests.chain
        return replace(
            checked, manifests=chain.head.length, not_sealed=chain.not_sealed, signed=chain.signed,
            keys=tuple(sorted(chain.keys)), head=chain.head if chain.head.length else None,
            remarks=tuple(self._remarks),
        )  # fmt: skip

    def find(self, part: str, text: str) -> None:
        """Note something down."""
        self.findings.append(Finding(part, " ".join(text.split())))

    def all_parts(self, connection: sa.Connection) -> None:
        """Check every part; one that cannot be read does not keep the others from being checked."""
        if not is_url(self._location) and (text := missing(connection, self._location)):
            self.find("file", text)
        for part, check_part in (("file", self._check_file), ("schema", self._check_schema)):
            if not self._try(part, check_part, connection):
                return
        parts = (
            ("readings", self._check_readings),
            ("calibrations", self._check_calibrations),
            ("audit", self._check_audit),
            ("manifests", self._check_manifests),
        )
        for part, check_part in parts:
            self._try(part, check_part, connection)

    def _try(self, part: str, check_part: Callable[[sa.Connection], bool], connection: sa.Connection) -> bool:
        self._progress(part, 0, 0)
        try:
            return check_part(connection)
        except exc.DatabaseError as error:
            self.find(part, f"cannot be read: {error.orig}")
        except (ValueError, TypeError) as error:  # the row is there, its content is of another kind
            self.find(part, f"cannot be read: {error}; check path and permissions")
        return part != "schema"

    def _check_file(self, connection: sa.Connection) -> bool:
        if is_url(self._location):
            return True
        for (text,) in connection.exec_driver_sql("PRAGMA integrity_check(20)"):
            if text != "ok":
                self.find("file", text)
        for table, row, parent, _ in connection.exec_driver_sql("PRAGMA foreign_key_check"):
            self.find("file", f"row {row} of {table} refers to a row of {parent} that is missing")
        return True

    def _check_schema(self, connection: sa.Connection) -> bool:
        revision = migrate.revision_of(connection)
        if revision == migrate.HEAD:
            return True
        if revision is None:
            self.find("schema", "this is not a labctl database, or its content is lost: there are no tables")
        elif revision == migrate.MOVING:
            self.find("schema", "`labctl move-database` into this database has not ended; run it again")
        else:
            hint = (
                f"run `labctl migrate --database {shown(self._location)}`"
                if revision in migrate.KNOWN
                else "use a newer version of labctl"
            )
            self.find(
                "schema",
                f"the schema of the database is number {revision}, that of this version of labctl "
                f"is {migrate.HEAD}: {hint}",
            )
        return False

    def _check_readings(self, connection: sa.Connection) -> bool:
        b, d, r = tables.sample_blocks.c, tables.data_sets.c, tables.recordings.c
        is_complete = r.importing.is_(None)  # what is being imported is not there yet
        kinds = {int(number): kind for number, kind in connection.execute(sa.select(r.id, r.kind).where(is_complete))}
        total = sa.select(sa.func.count(b.id)).where(_of_whole_recordings(b.recording_id))
        valid = self._valid_readings(connection, int(connection.scalar(total) or 0))
        block_places = set()
        heads = sa.select(d.recording_id, d.number, d.state, d.n).where(_of_whole_recordings(d.recording_id))
        for recording, number, state, n in connection.execute(heads):
            block_places.add((recording, number))
            n_valid = valid.get((recording, number), 0)
            if kinds.get(recording) == "samples" and state != "open" and n_valid is not None and n_valid != n:
                self.find(
                    "readings",
                    f"recording {recording} data set {number} is recorded as having {n} valid readings, "
                    f"but {n_valid} are stored",
                )
        for recording, kind in kinds.items():
            if kind != "samples" and (recording, WHOLE_TABLE) not in valid:
                self.find("readings", f"recording {recording} ({kind}): its table of data sets is missing")
        for recording, number in sorted(valid.keys() - block_places):
            if number != WHOLE_TABLE:
                self.find("readings", f"recording {recording} holds readings of data set {number}, which is missing")
        return True

    def _valid_readings(self, connection: sa.Connection, total: int) -> dict[tuple[int, int], int | None]:
        """Unpack every block; returns (recording, data set) -> valid readings, None where a block is damaged."""
        b = tables.sample_blocks.c
        query = sa.select(b.recording_id, b.number, b.seq, b.n, b.codec, b.crc32, b.data)
        query = query.where(_of_whole_recordings(b.recording_id))
        ordered = query.order_by(b.recording_id, b.number, b.seq).execution_options(yield_per=AT_ONCE)
        valid: dict[tuple[int, int], int | None] = {}
        expected: dict[tuple[int, int], int] = {}
        means = MeansCheck(connection)
        for recording, number, seq, n, codec, crc32, data in connection.execute(ordered):
            place = (recording, number)
            if seq != expected.get(place, 0):
                self.find("readings", f"recording {recording} data set {number}: blocks before block {seq} are missing")
                valid[place] = None
            expected[place] = seq + 1
            place_text = f"recording {recording} data set {number}"
            columns = self._unpacked(f"{place_text} block {seq}", sample_codec.Block(n, codec, crc32, data))
            self._note_block(recording, number, seq, n, columns)
            before, n_valid = valid.get(place, 0), None if columns is None else _count(columns, n)
            valid[place] = None if n_valid is None or before is None else before + n_valid
            for text in means.take(recording, number, columns):
                self.find("readings", text)
            self.blocks += 1
            if self.blocks % AT_ONCE == 0:
                self._progress("readings", self.blocks, total)
        for text in means.rest():
            self.find("readings", text)
        return valid

    def _note_block(
        self, recording: int, number: int, seq: int, n: int, columns: dict[str, NDArray[np.generic]] | None
    ) -> None:
        """Keep the digests of a block for the comparison with manifests; a damaged one has its own finding."""
        parts = self._block_parts.setdefault(recording, BlockParts())
        if columns is None:
            self._block_parts[recording] = None
        elif parts is not None:
            parts.take(number, seq, n, block_digests(columns))

    def _unpacked(self, place: str, block: sample_codec.Block) -> dict[str, NDArray[np.generic]] | None:
        try:
            columns = sample_codec.unpack(block)
        except StoreError as error:
            self.find("readings", f"{place}: {error}")
            return None
        except (
            ValueError,
            TypeError,
            LookupError,
            RuntimeError,
            struct.error,
        ) as error:  # the checksum fits, the content does not
            self.find("readings", f"{place}: cannot be unpacked ({error})")
            return None
        if any(len(values) != block.n for values in columns.values()):
            self.find("readings", f"{place}: its columns do not have the {block.n} readings that its header gives")
            return None
        return columns

    def _check_calibrations(self, connection: sa.Connection) -> bool:
        from labctl.calibration import read_calibration  # noqa: PLC0415  it loads every model, which no other part needs

        c = tables.calibrations.c
        for serial, version, digest, document in connection.execute(sa.select(c.serial, c.version, c.hash, c.document)):
            self.calibrations += 1
            try:
                calibration = read_calibration(document if isinstance(document, bytes) else str(document).encode())
            except BadCalibrationFile as error:
                self.find("calibrations", f"{serial} version {version}: {error}")
                continue
            if (calibration.serial, calibration.version, calibration.hash) != (serial, version, digest):
                version_text = f"{calibration.serial} version {calibration.version}"
                self.find(
                    "calibrations", f"{serial} version {version}: the stored calibration was changed ({version_text})"
                )
        return True

    def _check_audit(self, connection: sa.Connection) -> bool:
        self.audit_rows = int(connection.scalar(sa.select(sa.func.count(tables.audit.c.id))) or 0)
        if broken := first_broken(connection, self._anchor):
            self.find("audit", f"row {broken.row}: {broken.what}")
        return True

    def _check_manifests(self, connection: sa.Connection) -> bool:
        self._manifests = ManifestCheck(connection, self.find, self.keys)
        trail_fits = all(finding.part != "audit" for finding in self.findings)
        self._manifests.check_chain(self._chain_anchors(), trail_fits=trail_fits)
        blocks: Mapping[int, Parts | None] = {
            recording: None if parts is None else parts.parts() for recording, parts in self._block_parts.items()
        }
        self._manifests.check_records(blocks)
        return True

    def _chain_anchors(self) -> dict[str, ChainHead]:
        """Return the heads that are noted down outside the database, by where that is."""
        anchors = {} if self.chain_anchor is None else {"the given anchor": self.chain_anchor}
        if is_url(self._location):
            if not anchors:
                self._remarks.append("a server has no anchor file; give --anchor LENGTH:HASH to compare one")
            return anchors
        path = anchor_path(self._location)
        try:
            anchor = read_anchor(self._location)
        except ValueError:
            self._remarks.append(f"{path}: the anchor file is damaged; the end of the chain was not compared with it")
            return anchors
        if anchor is None:
            self._remarks.append(f"{path}: there is no anchor file; the end of the chain was not compared with it")
            return anchors
        return {**anchors, f"the anchor file {path.name}": anchor}


def _of_whole_recordings(recording: sa.ColumnElement[int]) -> sa.ColumnElement[bool]:
    """Return the condition that a row is of no recording that is being imported."""
    r = tables.recordings.c
    return recording.not_in(sa.select(r.id).where(r.importing.is_not(None)))


def _count(columns: dict[str, NDArray[np.generic]], n: int) -> int:
    return int(np.count_nonzero(columns["valid"])) if "valid" in columns else n
