"""Servo tables that are described and nothing more: a shipped description, and where it is tried."""

from __future__ import annotations

from pydantic import model_validator

from instruments.drivers.driver import TableDriver, Trial
from instruments.drivers.request_reply.table import DescribedTable
from instruments.protocols.request_reply.settings import DescribedTableSettings


class NewportXpsSettings(DescribedTableSettings):
    """One group of a Newport XPS, which `parameters = { group = "NAME" }` names."""

    @model_validator(mode="before")
    @classmethod
    def _described(cls, document: object) -> object:
        return _with_format(document, "newport-xps")


class AerotechEnsembleSettings(DescribedTableSettings):
    """One axis of an Aerotech Ensemble, which `parameters = { axis = 1 }` names."""

    @model_validator(mode="before")
    @classmethod
    def _described(cls, document: object) -> object:
        return _with_format(document, "aerotech-ensemble")


def _with_format(document: object, name: str) -> object:
    return {"format": name, **document} if isinstance(document, dict) else document


XPS_DRIVER = TableDriver(
    NewportXpsSettings,
    DescribedTable,
    Trial("servo-sim", {"host": "sim://newport-xps", "reference": "measured"}),
)
ENSEMBLE_DRIVER = TableDriver(
    AerotechEnsembleSettings,
    DescribedTable,
    Trial("servo-sim", {"host": "sim://aerotech-ensemble", "reference": "measured"}),
)
