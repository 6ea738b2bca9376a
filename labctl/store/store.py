"""The open database: one repository for each kind of record."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass

from labctl.config import seal_key
from labctl.store.connection.database import Database, Writer
from labctl.store.connection.location import is_url
from labctl.store.connection.transactions import run_transaction
from labctl.store.connection.writer_lock import NO_SERVICE, ServiceAddress, holder_of
from labctl.store.repositories.audit import Audit
from labctl.store.repositories.benches import Benches
from labctl.store.repositories.calibrations import Calibrations
from labctl.store.repositories.campaigns import Campaigns
from labctl.store.repositories.certificates import Certificates
from labctl.store.repositories.certified_versions import CertifiedVersions
from labctl.store.repositories.check_gyros import CheckGyros
from labctl.store.repositories.diagnoses import Diagnoses
from labctl.store.repositories.drafts.repository import Drafts
from labctl.store.repositories.due_units import DueUnits
from labctl.store.repositories.fetches import Fetches
from labctl.store.repositories.fleet_jobs import FleetJobs
from labctl.store.repositories.fleet_reports import FleetReports
from labctl.store.repositories.imports import Imports
from labctl.store.repositories.keys import Keys
from labctl.store.repositories.leases import Leases
from labctl.store.repositories.manifests import Manifests
from labctl.store.repositories.recordings import Recordings
from labctl.store.repositories.releases import ReleaseRequests
from labctl.store.repositories.replication import Replication
from labctl.store.repositories.resume_points import ResumePoints
from labctl.store.repositories.room_environment import RoomEnvironment
from labctl.store.repositories.sample_blocks import ReadBlocks, blocks_of_sets
from labctl.store.repositories.scheduled_starts import Starts
from labctl.store.repositories.sensors import SensorVersions
from labctl.store.repositories.standards import Standards
from labctl.store.repositories.units import Certifications, Units
from labctl.store.sealing.signing import begin_signing


class Store:
    """An open database with its repositories."""

    def __init__(self, database: Database, read_blocks: ReadBlocks = blocks_of_sets) -> None:
        """`read_blocks` returns the readings of recordings, by default those of the database."""
        self._database, self.read_blocks = database, read_blocks
        self.units = Units(database)
        self.due_units = DueUnits(database)
        self.recordings = Recordings(database, read_blocks)
        self.imports = Imports(database)
        self.campaigns = Campaigns(database)
        self.resume_points = ResumePoints(database)
        self.benches = Benches(database)
        self.calibrations = Calibrations(database)
        self.certifications = Certifications(database)
        self.certified_versions = CertifiedVersions(database)
        self.certificates = Certificates(database)
        self.release_requests = ReleaseRequests(database)
        self.fetches = Fetches(database)
        self.drafts = Drafts(database)
        self.diagnoses = Diagnoses(database)
        self.fleet = FleetJobs(database)
        self.fleet_reports = FleetReports(database)
        self.standards = Standards(database)
        self.check_gyros = CheckGyros(database)
        self.sensor_versions = SensorVersions(database)
        self.room_environment = RoomEnvironment(database)
        self.audit = Audit(database)
        self.keys = Keys(database)
        self.starts = Starts(database)
        self.leases = Leases(database)
        self.manifests = Manifests(database)
        self.replication = Replication(database)
        self._signing = begin_signing(database, seal_key()) if database.writes else None

    @property
    def location(self) -> str:
        """Where the database is."""
        return self._database.location

    @property
    def is_held(self) -> bool:
        """Whether a process, perhaps this one, holds the database for writing."""
        return self._database.writes or is_url(self.location) or holder_of(self.location) is not None

    @property
    def is_read_only(self) -> bool:
        """Whether this process may never change the database."""
        return self._database.is_read_only

    @property
    def is_sole_writer(self) -> bool:
        """Whether no other process can write to the database as long as this one holds it."""
        return self._database.writes and not is_url(self.location)

    @property
    def is_shared(self) -> bool:
        """Whether several processes may write to the database at the same time, each with a bench of its own."""
        return self._database.is_shared

    def reading_from(self, read_blocks: ReadBlocks) -> Store:
        """Return this store with the readings of recordings from elsewhere; it is open for as long as this one."""
        other = copy(self)
        other.read_blocks, other.recordings = read_blocks, Recordings(self._database, read_blocks)
        return other

    @property
    def address(self) -> StoreAddress:
        """The address by which another process opens the same database."""
        return StoreAddress(self.location, self._database.writer, self.is_read_only)

    def note_address(self, address: ServiceAddress) -> None:
        """Write down at which address the service that holds this database is reached now."""
        self._database.note_address(address)

    def run(self, name: str, args: tuple[object, ...], kwargs: Mapping[str, object]) -> object:
        """Run a transaction that another process sent; raises what it raises, and KeyError for an unknown name."""
        return run_transaction(
            {type(each).__name__: each for each in vars(self).values() if hasattr(each, "_database")},
            name,
            args,
            kwargs,
        )

    def close(self) -> None:
        """Close the database."""
        if self._signing is not None:
            self._signing.close()
        self._database.close()


@contextmanager
def open_store(
    location: str,
    *,
    write: bool,
    address: ServiceAddress = NO_SERVICE,
    writer: Writer | None = None,
    read_only: bool = False,
    read_blocks: ReadBlocks = blocks_of_sets,
) -> Iterator[Store]:
    """Open a database by path or URL, made on first use; `write` holds it for this process.

    Without, transactions run by `writer`, the process that holds it. With `read_only` every transaction is refused, and
    no database is made. `read_blocks` returns the readings of recordings where they are not those of the database.

    Raises Conflict when another process holds it, StoreError when it is newer than the code or damaged, OldSchema
    when it has to be migrated first.
    """
    database = Database(location, write=write, address=address, writer=writer, read_only=read_only)
    store = Store(database, read_blocks)
    try:
        if write:
            store.imports.discard_unfinished()
        yield store
    finally:
        store.close()


@dataclass(frozen=True)
class StoreAddress:
    """The address by which a process opens a store that another one has; like its writer it can be pickled."""

    location: str  #: path or URL
    writer: Writer | None = None  #: the process that writes for others
    read_only: bool = False  #: no process that opens it so may change it

    @property
    def can_write(self) -> bool:
        """Whether a store opened by this address can be written to while another process has the database."""
        return not self.read_only and (self.writer is not None or is_url(self.location))

    @contextmanager
    def open(self) -> Iterator[Store]:
        """Open the store; without a writer for reading. Raises StoreError."""
        with open_store(self.location, write=False, writer=self.writer, read_only=self.read_only) as store:
            yield store
