"""The open database: one repository for each kind of record."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

from labctl.config import seal_key
from labctl.store.connection.database import Database, Writer
from labctl.store.connection.location import is_url
from labctl.store.connection.transactions import TRANSACTIONS, run_transaction
from labctl.store.connection.writer_lock import NO_SERVICE, ServiceAddress, holder_of
from labctl.store.sealing.signing import begin_signing

if TYPE_CHECKING:
    from labctl.store.repositories.audit import Audit
    from labctl.store.repositories.benches import Benches
    from labctl.store.repositories.calibration_events import CalibrationEvents
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
    from labctl.store.repositories.sample_blocks import ReadBlocks
    from labctl.store.repositories.scheduled_starts import Starts
    from labctl.store.repositories.sensors import SensorVersions
    from labctl.store.repositories.standards import Standards
    from labctl.store.repositories.units import Certifications, Units

#: The repositories of a store, attribute -> module and class; each is imported when it is asked for.
REPOSITORIES: Mapping[str, tuple[str, str]] = {
    "units": ("units", "Units"),
    "due_units": ("due_units", "DueUnits"),
    "recordings": ("recordings", "Recordings"),
    "imports": ("imports", "Imports"),
    "campaigns": ("campaigns", "Campaigns"),
    "resume_points": ("resume_points", "ResumePoints"),
    "benches": ("benches", "Benches"),
    "calibrations": ("calibrations", "Calibrations"),
    "calibration_events": ("calibration_events", "CalibrationEvents"),
    "certifications": ("units", "Certifications"),
    "certified_versions": ("certified_versions", "CertifiedVersions"),
    "certificates": ("certificates", "Certificates"),
    "release_requests": ("releases", "ReleaseRequests"),
    "fetches": ("fetches", "Fetches"),
    "drafts": ("drafts.repository", "Drafts"),
    "diagnoses": ("diagnoses", "Diagnoses"),
    "fleet": ("fleet_jobs", "FleetJobs"),
    "fleet_reports": ("fleet_reports", "FleetReports"),
    "standards": ("standards", "Standards"),
    "check_gyros": ("check_gyros", "CheckGyros"),
    "sensor_versions": ("sensors", "SensorVersions"),
    "room_environment": ("room_environment", "RoomEnvironment"),
    "audit": ("audit", "Audit"),
    "keys": ("keys", "Keys"),
    "starts": ("scheduled_starts", "Starts"),
    "leases": ("leases", "Leases"),
    "manifests": ("manifests", "Manifests"),
    "replication": ("replication", "Replication"),
}
_ATTRIBUTES = {name: attribute for attribute, (_, name) in REPOSITORIES.items()}


class Store:
    """An open database with its repositories."""

    units: Units
    due_units: DueUnits
    recordings: Recordings
    imports: Imports
    campaigns: Campaigns
    resume_points: ResumePoints
    benches: Benches
    calibrations: Calibrations
    calibration_events: CalibrationEvents
    certifications: Certifications
    certified_versions: CertifiedVersions
    certificates: Certificates
    release_requests: ReleaseRequests
    fetches: Fetches
    drafts: Drafts
    diagnoses: Diagnoses
    fleet: FleetJobs
    fleet_reports: FleetReports
    standards: Standards
    check_gyros: CheckGyros
    sensor_versions: SensorVersions
    room_environment: RoomEnvironment
    audit: Audit
    keys: Keys
    starts: Starts
    leases: Leases
    manifests: Manifests
    replication: Replication

    def __init__(self, database: Database, read_blocks: ReadBlocks | None = None) -> None:
        """`read_blocks` returns the readings of recordings, by default those of the database."""
        self._database, self._read_blocks = database, read_blocks
        self._signing = begin_signing(database, seal_key()) if database.writes else None

    def __getattr__(self, name: str) -> object:
        """Return a repository, made when it is first asked for."""
        if name not in REPOSITORIES:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        made = _class_of(name)
        repository = made(self._database, self.read_blocks) if name == "recordings" else made(self._database)
        return self.__dict__.setdefault(name, repository)  # the same for every thread

    @property
    def read_blocks(self) -> ReadBlocks:
        """What returns the readings of recordings."""
        if self._read_blocks is None:
            from labctl.store.repositories.sample_blocks import blocks_of_sets  # noqa: PLC0415  loads numpy

            return blocks_of_sets
        return self._read_blocks

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
        vars(other).pop("recordings", None)  # those of this store
        vars(other)["_read_blocks"] = read_blocks
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
        repository = name.partition(".")[0]
        if repository not in _ATTRIBUTES:
            raise KeyError(name)
        return run_transaction({repository: getattr(self, _ATTRIBUTES[repository])}, name, args, kwargs)

    def close(self) -> None:
        """Close the database."""
        if self._signing is not None:
            self._signing.close()
        self._database.close()


def transactions() -> Mapping[str, Callable[..., object]]:
    """Return all methods that may be sent to the process that writes, by their names, as `Benches.mark`."""
    for attribute in REPOSITORIES:
        _class_of(attribute)
    return TRANSACTIONS


def _class_of(attribute: str) -> Callable[..., object]:
    module, name = REPOSITORIES[attribute]
    made: Callable[..., object] = getattr(import_module(f"labctl.store.repositories.{module}"), name)
    return made


@contextmanager
def open_store(
    location: str,
    *,
    write: bool,
    address: ServiceAddress = NO_SERVICE,
    writer: Writer | None = None,
    read_only: bool = False,
    read_blocks: ReadBlocks | None = None,
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
            transactions()  # all that other processes may ask for is loaded before anything runs
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
