"""Description of a reference thermometer or hygrometer: how it is asked for its quantities."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from instruments.protocols.request_reply.parts import Description
from instruments.protocols.request_reply.templates import require_template
from instruments.protocols.text_lines.quantity import Quantity


class ReferenceDescription(Description):
    """A readout. A quantity is described as in the bench file of the driver `line-reference`."""

    kind: Literal["reference"]
    identity: str = ""  #: the request; empty: it reports no identity
    quantities: dict[str, Quantity] = Field(min_length=1)

    @model_validator(mode="after")
    def _is_whole(self) -> ReferenceDescription:
        for name, quantity in self.quantities.items():
            try:
                require_template(quantity.ask, (), ("input",))
            except ValueError as error:
                raise ValueError(f"quantities.{name}: {error}") from None
        return self
