"""The laboratory that a bench belongs to, as its certificates name it (ISO/IEC 17025:2017, 7.8.2.1 b and c)."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

#: Where a calibration was performed, in the words of the DCC schema.
Place = Literal["laboratory", "customer", "laboratoryBranch", "customerBranch", "other"]
#: ISO 3166-1 alpha-2.
COUNTRY = r"^[A-Z]{2}$"
#: One line of text; an empty one is a fact that is missing.
LINE = r"^[^\x00-\x1f\x7f]{0,300}$"


class Contact(BaseModel):
    """Name and address of an organisation; what is empty was not stated."""

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True, str_strip_whitespace=True)

    name: str = Field(default="", pattern=LINE, description="Name of the organisation; empty: not stated.")
    street: str = Field(default="", pattern=LINE, description="Street and number, or post-office box.")
    post_code: str = Field(default="", pattern=LINE, description="Postal code; empty: not stated.")
    city: str = Field(default="", pattern=LINE, description="City; empty: not stated.")
    country: str = Field(
        default="", pattern=rf"{COUNTRY}|^$", description="Code of the country (ISO 3166-1 alpha-2), such as DE."
    )
    email: str = Field(default="", pattern=LINE, description="E-mail address; empty: not stated.")
    phone: str = Field(default="", pattern=LINE, description="Telephone number; empty: not stated.")


class Laboratory(Contact):
    """The laboratory of a bench file: `[laboratory]`."""

    accreditation: str = Field(
        default="", pattern=LINE, description="Accreditation number of the laboratory; empty: not accredited."
    )
    place: Place = Field(
        default="laboratory", description="Where the calibration was performed, in the words of the DCC schema."
    )
    url: str = Field(
        default="",
        pattern=r"^(https?://[^\s\x00-\x1f]{1,300})?$",
        description="Address of labctl as a customer reaches it, for the QR code of a certificate; empty: none.",
    )
    number_prefix: str = Field(
        default="",
        pattern=r"^[A-Za-z0-9._/-]{0,40}$",
        description="Prefix of the number of every certificate, so that no two laboratories have a number in common.",
    )
    procedure: str = Field(
        default="", pattern=LINE, description="Number of the laboratory's written calibration procedure."
    )
