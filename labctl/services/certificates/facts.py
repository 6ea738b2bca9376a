"""The facts of a certificate, from the store and from the order; what is missing is named all at once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date

from instruments.bench_config import BenchFile
from instruments.laboratory import Laboratory
from instruments.standards import SIMULATED, Standard
from labctl.answers.certificates import CertificateOrder
from labctl.calibration import Calibration, read_calibration
from labctl.services.certificates import remedies
from labctl.services.certificates.missing import MissingFact, of_contact
from labctl.services.certificates.sensors import Sensors, missing_of
from labctl.services.standards.usage import performed
from labctl.services.standards.where_stated import place_of_standards
from labctl.store import CalibrationRecord, CampaignRow, CertificationRow, RecordingRow, Store

ORDER = "[laboratory] of the order"
BENCH = f"[laboratory] of the bench file of the campaign, or {ORDER}"
#: Quantities that a rate, or an angle over a time, is known from.
RATE = frozenset({"clock", "table_rate", "turn_angle"})


@dataclass(frozen=True)
class Facts:
    """What a certificate is made from, as it was found; None or empty: not stated."""

    row: CalibrationRecord
    calibration: Calibration
    recordings: tuple[RecordingRow, ...]
    campaign: CampaignRow | None  #: of the newest recording
    order: CertificateOrder
    laboratory: Laboratory
    names_laboratory: bool  #: whether the bench file of the campaign names the laboratory, which then counts
    standards: tuple[Standard, ...]
    authorised: CertificationRow | None
    performed_from: date | None
    performed_until: date | None
    simulated: bool
    sensors: Sensors

    @property
    def what(self) -> str:
        """Unit and version."""
        return f"{self.row.serial} version {self.row.version}"

    @property
    def method(self) -> str:
        """The recipe of the campaign, or what the order says."""
        return self.order.method.name if self.campaign is None else f"recipe {self.campaign.recipe_name}"

    @property
    def imported(self) -> bool:
        """Whether the newest recording was imported: no campaign of this database measured it."""
        return self.campaign is None

    @property
    def manufacturer(self) -> str:
        """The manufacturer of the item, as the order states it."""
        return self.order.item.manufacturer

    def missing(self) -> Iterator[MissingFact]:
        """Yield each mandatory fact that is not stated, and where to state it."""
        yield from self._laboratory()
        yield from of_contact(self.order.customer, "customer", "[customer] of the order")
        if not self.manufacturer:
            yield MissingFact("item's manufacturer", "[item] of the order", "item", "manufacturer")
        if not self.order.item.condition.strip():
            yield MissingFact("item's condition", "[item] of the order", "item", "condition")
        if not self.calibration.document["unit"]["model"]:
            where = "model of recording.toml" if self.imported else "model of [[gyros]] of the bench file"
            yield MissingFact("item's model", where, remedy=remedies.of_model(self.imported))
        if not self.recordings:
            where = f"`labctl fit {self.row.serial}` on one"
            yield MissingFact("measured recording", where, remedy=remedies.NO_RECORDING)
        if not self.method:
            yield MissingFact("name of the method", "[method] of the order", "method", "name")
        for day, name in ((self.performed_from, "performed_from"), (self.performed_until, "performed_until")):
            if day is None:
                yield MissingFact(name, "[method] of the order", "method", name)
        yield from self._authorisation()
        yield from missing_of(self.order)
        yield from self._traceability()

    def _laboratory(self) -> Iterator[MissingFact]:
        """Yield what is missing of the laboratory; the order states none beside that of the bench file."""
        later = "" if self.imported else remedies.LATER
        for fact in of_contact(self.laboratory, "laboratory", ORDER if self.imported else BENCH):
            if self.names_laboratory:
                yield fact._replace(table=None, key="", remedy=remedies.LABORATORY)
            else:
                yield fact._replace(remedy=later)

    def _authorisation(self) -> Iterator[MissingFact]:
        certify = f"`labctl certify {self.row.serial} {self.row.version}"
        if self.authorised is None:
            where = f"{certify} --by NAME --reason TEXT`"
            yield MissingFact("authorisation", where, remedy=remedies.of_authorisation(self.row.version))
        elif self.order.state_due and self.authorised.due_at is None:
            yield MissingFact(
                "date of the next calibration, which state_due of the order asks for",
                f"{certify} --due-days DAYS ...`, or leave state_due out",
                remedy=remedies.DUE,
            )

    def _traceability(self) -> Iterator[MissingFact]:
        remedy, where = remedies.of_standards(self.imported), place_of_standards(imported=self.imported)
        if self.standards and not {standard.quantity for standard in self.standards} & RATE:
            yield MissingFact("standard of the rate", where, remedy=remedy)
        if not self.standards:
            yield MissingFact("reference standards", where, remedy=remedy)
        measured = any(standard.quantity in RATE and standard.certificate for standard in self.standards)
        for standard in self.standards:
            if standard.quantity in RATE and measured and not standard.certificate:
                continue  # follows from the time base that has one
            lacking = [name for name in ("certificate", "issued_by", "due") if not getattr(standard, name)]
            if lacking and not standard.traceability:
                what = f"{', '.join(lacking)} (or traceability) of standard {standard.label}"
                yield MissingFact(what, where, remedy=remedy)


def facts_of(store: Store, serial: str, version: int, order: CertificateOrder) -> Facts:
    """Return the facts of a version. Raises NotFound."""
    row = store.calibrations.get(store.units.get(serial).serial, version)
    rows = tuple(store.recordings.get(number) for number in row.recordings)
    measured = tuple(each for each in rows if each.kind != "coefficients")
    campaign = store.campaigns.get(measured[-1].campaign) if measured and measured[-1].campaign is not None else None
    bench = None if campaign is None else BenchFile.model_validate(campaign.bench)
    spans = [performed(store, each) for each in measured]
    since = [first for first, _ in spans if first is not None]
    since = since if len(since) == len(spans) else []  # of a recording without a date the order states the days
    until = [last for _, last in spans if last is not None] if since else []
    method = order.method
    return Facts(
        row=row,
        calibration=read_calibration(row.document),
        recordings=measured,
        campaign=campaign,
        order=order,
        laboratory=(bench.laboratory if bench else None) or order.laboratory or Laboratory(),
        names_laboratory=bench is not None and bench.laboratory is not None,
        standards=_standards(measured),
        authorised=next((act for act in store.calibrations.history(serial) if act.version == version), None),
        performed_from=min(since, default=None) if campaign else method.performed_from
        or min(since, default=None),
        performed_until=max(until, default=None) if campaign else method.performed_until or max(until, default=None)
        or method.performed_from,
        simulated=(bench is not None and bench.has_simulated)
        or any(standard.traceability == SIMULATED for standard in _standards(measured)),
        sensors=Sensors.of(store, row.serial, order),
    )  # fmt: skip


def _standards(rows: tuple[RecordingRow, ...]) -> tuple[Standard, ...]:
    """Return the standards that the recordings were made with, each once: those whose uncertainties are in U."""
    return tuple(dict.fromkeys(each for row in rows for each in row.recording_info.standards))
