"""Mandatory facts that were not stated: all of them at once, each with the place to state it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

from instruments.laboratory import Contact
from labctl.answers.certificates import OrderTable
from labctl.answers.json_object import JsonObject
from labctl.errors import BadInput

#: Facts of an address that a letter, and the schema of the DCC, need.
ADDRESS = ("name", "street", "post_code", "city", "country")


class MissingFact(NamedTuple):
    """A mandatory fact that is not stated."""

    fact: str
    where: str  #: where to state it, in words
    table: OrderTable | None = None  #: the table of the order that can state it; None: the order cannot
    key: str = ""  #: its key in that table
    remedy: str = ""  #: what a person does where the order cannot, or need not, state it; a sentence


class MissingFacts(BadInput):
    """Mandatory facts of a certificate are missing; nothing was written."""

    slug = "missing-facts"

    def __init__(self, text: str, facts: Sequence[MissingFact] = ()) -> None:
        super().__init__(text)
        self.facts = list(facts)

    @classmethod
    def of(cls, what: str, facts: Sequence[MissingFact]) -> MissingFacts:
        """Return the error that names every fact with the place where it is stated."""
        places: dict[str, list[str]] = {}
        for each in facts:
            places.setdefault(each.where, []).append(each.fact)
        count = "1 fact is missing" if len(facts) == 1 else f"{len(facts)} facts are missing"
        text = "; ".join(f"{', '.join(names)}: {place}" for place, names in places.items())
        return cls(f"no certificate of {what}: {count}. {text}", facts)

    @property
    def members(self) -> JsonObject:
        """Each fact, where it is stated, its table and key in the order, and the remedy where the order cannot."""
        return {"missing": [each._asdict() for each in self.facts]}


def of_contact(contact: Contact, whose: Literal["customer", "laboratory"], where: str) -> Iterator[MissingFact]:
    """Yield what is missing of an address, and a way to reach it."""
    for name in ADDRESS:
        if not getattr(contact, name):
            yield MissingFact(f"{whose}'s {name.replace('_', ' ')}", where, whose, name)
    if not (contact.email or contact.phone):
        yield MissingFact(f"{whose}'s email or phone", where, whose, "email")
