from labctl.store.connection.anchor_file import parse_anchor as parse_anchor
from labctl.store.connection.database import Writer as Writer
from labctl.store.connection.location import database_name as database_name, is_url as is_url, shown as shown
from labctl.store.connection.writer_lock import (
    Holder as Holder,
    ServiceAddress as ServiceAddress,
    holder_of as holder_of,
)
from labctl.store.integrity.backup import Copy as Copy, copy_database as copy_database
from labctl.store.integrity.check import Checked as Checked, Finding as Finding, Progress as Progress, check as check
from labctl.store.integrity.migration import (
    Migrated as Migrated,
    migrate_database as migrate_database,
    needs_migration as needs_migration,
)
from labctl.store.integrity.move import Moved as Moved, move_database as move_database
from labctl.store.manifests.chain import ChainHead as ChainHead
from labctl.public_keys import PublicKey as PublicKey, read_public_key as read_public_key
from labctl.store.records import (
    AuditRow as AuditRow,
    CalibrationRecord as CalibrationRecord,
    CampaignRow as CampaignRow,
    CertificationRow as CertificationRow,
    DataSetRow as DataSetRow,
    EventRow as EventRow,
    Judgement as Judgement,
    KeyRow as KeyRow,
    MeanRow as MeanRow,
    NewUnit as NewUnit,
    RecordingRow as RecordingRow,
    Release as Release,
    ServedCalibration as ServedCalibration,
    StepRow as StepRow,
    Unit as Unit,
    Withdrawal as Withdrawal,
)
from labctl.store.repositories.audit import Audit as Audit, Broken as Broken, Head as Head
from labctl.store.repositories.benches import BenchRow as BenchRow, Benches as Benches
from labctl.store.repositories.calibration_events import (
    CalibrationEvent as CalibrationEvent,
    CalibrationEvents as CalibrationEvents,
)
from labctl.store.repositories.calibrations import Calibrations as Calibrations, NewCalibration as NewCalibration
from labctl.store.repositories.campaign_journal import StoreJournal as StoreJournal
from labctl.store.repositories.campaign_summaries import CampaignSummary as CampaignSummary
from labctl.store.repositories.campaigns import Campaigns as Campaigns, NewCampaign as NewCampaign
from labctl.store.repositories.certified_versions import (
    CertifiedVersion as CertifiedVersion,
    CertifiedVersions as CertifiedVersions,
)
from labctl.store.repositories.check_gyros import CheckGyroRow as CheckGyroRow, CheckGyros as CheckGyros
from labctl.store.repositories.certificates import (
    CertificateForms as CertificateForms,
    CertificateRow as CertificateRow,
    Certificates as Certificates,
)
from labctl.store.repositories.diagnoses import (
    Diagnoses as Diagnoses,
    DiagnosisRow as DiagnosisRow,
    NewDiagnosis as NewDiagnosis,
    NewRound as NewRound,
    RoundRow as RoundRow,
)
from labctl.store.repositories.drafts.repository import (
    DraftEvent as DraftEvent,
    DraftRow as DraftRow,
    DraftState as DraftState,
)
from labctl.store.repositories.drafts.repository import Drafts as Drafts
from labctl.store.repositories.fetches import FetchRow as FetchRow, Fetches as Fetches
from labctl.store.repositories.fleet_filter import FleetFilter as FleetFilter
from labctl.store.repositories.fleet_jobs import (
    FleetCoefficient as FleetCoefficient,
    FleetCounts as FleetCounts,
    FleetEvidence as FleetEvidence,
    FleetFit as FleetFit,
    FleetJobRow as FleetJobRow,
    FleetJobs as FleetJobs,
    FleetResult as FleetResult,
    FleetUnitRow as FleetUnitRow,
    NewFleetJob as NewFleetJob,
)
from labctl.store.repositories.fleet_reports import (
    ChartPoint as ChartPoint,
    FleetReports as FleetReports,
    FleetVersion as FleetVersion,
    TypeFigures as TypeFigures,
)
from labctl.store.repositories.keys import Keys as Keys, keys_by_digests as keys_by_digests
from labctl.store.repositories.leases import LeaseRow as LeaseRow, Leases as Leases
from labctl.store.repositories.manifests import ManifestRow as ManifestRow, Manifests as Manifests
from labctl.store.repositories.imports import ImportTicket as ImportTicket, Imports as Imports
from labctl.store.repositories.published_readings import PublishedReadings as PublishedReadings
from labctl.store.repositories.recordings import Recordings as Recordings
from labctl.store.repositories.releases import (
    NewReleaseRequest as NewReleaseRequest,
    ReleaseRequestRow as ReleaseRequestRow,
    ReleaseRequests as ReleaseRequests,
)
from labctl.store.repositories.resume_points import (
    ResumePoint as ResumePoint,
    ResumePoints as ResumePoints,
    Resumption as Resumption,
)
from labctl.store.repositories.room_environment import (
    RoomEnvironment as RoomEnvironment,
    RoomReading as RoomReading,
    RoomSpan as RoomSpan,
)
from labctl.store.repositories.scheduled_starts import (
    NewStart as NewStart,
    StartEventRow as StartEventRow,
    StartRow as StartRow,
    Starts as Starts,
)
from labctl.store.repositories.sensors import (
    NewSensorVersion as NewSensorVersion,
    Sensor as Sensor,
    SensorVersionRow as SensorVersionRow,
    SensorVersions as SensorVersions,
)
from labctl.store.repositories.standards import (
    CertifiedPoint as CertifiedPoint,
    RegisteredStandard as RegisteredStandard,
    StandardCertificate as StandardCertificate,
    StandardCheck as StandardCheck,
    StandardFinding as StandardFinding,
    StandardRow as StandardRow,
    Standards as Standards,
)
from labctl.store.repositories.units import Units as Units, served_together as served_together
from labctl.store.sealing.signers import (
    SEAL_KEY as SEAL_KEY,
    Signer as Signer,
    create_key as create_key,
    signer_of as signer_of,
)
from labctl.store.sealing.signing import sign_chain as sign_chain
from labctl.store.store import Store as Store, StoreAddress as StoreAddress, open_store as open_store
