"""Certificates: the facts of an order, the request, and what was issued."""

from __future__ import annotations

from datetime import date, datetime

from pydantic import Field

from instruments.laboratory import LINE, Laboratory
from labctl.certificates.document import Customer, DecisionRule
from labctl.services.schemas.base import Request, ResponseModel

TEXT = 2000


class OrderedItem(Request):
    """What the laboratory noted of the item when it came."""

    description: str = Field(default="Gyroscope", pattern=LINE)
    manufacturer: str = Field(default="", pattern=LINE)
    identification: str = Field(default="", pattern=LINE, description="The customer's own number of the item.")
    condition: str = Field(default="", max_length=TEXT, description="Condition of the item on receipt.")
    received: date | None = Field(default=None, description="Date of receipt; null: the results do not depend on it.")


class OrderedMethod(Request):
    """What is to be said of the method beside the recipe."""

    name: str = Field(default="", pattern=LINE, description="Of an imported recording; a campaign has its recipe.")
    deviations: str = Field(
        default="", max_length=TEXT, description="Additions to, deviations or exclusions from the method; empty: none."
    )
    performed_from: date | None = Field(default=None, description="Of an imported recording; a campaign has its own.")
    performed_until: date | None = None


class OrderedConformity(Request):
    """The specification to which conformity is to be stated, and the rule."""

    specification: str = Field(min_length=1, pattern=LINE)
    limit_dps: float = Field(gt=0, allow_inf_nan=False, description="Largest permitted error of a corrected rate.")
    rule: DecisionRule = Field(
        description="simple: pass up to the limit; guard-band: pass up to the limit less the expanded uncertainty."
    )


class CertificateOrder(Request):
    """The facts of the order: what a campaign cannot know. They are kept with the certificate."""

    customer: Customer = Customer()
    item: OrderedItem = OrderedItem()
    method: OrderedMethod = OrderedMethod()
    conformity: OrderedConformity | None = Field(default=None, description="null: no statement is made.")
    adjustment: str = Field(default="", max_length=TEXT, description="What was adjusted or repaired beside the "
                            "coefficients; empty: nothing.")  # fmt: skip
    external: str = Field(
        default="", max_length=TEXT, description="Results of external providers, and whose; empty: there are none."
    )
    state_due: bool = Field(
        default=False, description="State the date of the next calibration: only where the customer agreed to it."
    )
    laboratory: Laboratory | None = Field(
        default=None, description="Where the bench file of the campaign has no [laboratory]."
    )


class CertificateRequest(Request):
    """Issue the certificate of a version, or an amended one."""

    by: str = Field(min_length=1, max_length=200, pattern=LINE, description="Person who issues it.")
    order: CertificateOrder = CertificateOrder()
    amend: str | None = Field(
        default=None,
        min_length=1,
        max_length=TEXT,
        description="Why the certificate of this version is replaced by a new one; null: it is not.",
    )


class CertificateResponse(ResponseModel):
    """A certificate that was issued."""

    serial: str
    version: int
    number: str
    issued_at: datetime
    by: str
    hash: str = Field(description="SHA-256 of its JSON.")
    replaces: str | None = Field(description="Number of the certificate that it replaces; null: none.")
    reason: str = Field(description="Why it replaces another one; empty: it does not.")
    replaced_by: str | None = Field(default=None, description="Number of the one that replaces it; null: it is valid.")
