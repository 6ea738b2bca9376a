"""Mandatory facts that were not stated: all of them at once, each with the place to state it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from instruments.laboratory import Contact
from labctl.answers.json_object import JsonObject
from labctl.errors import BadInput

#: Facts of an address that a letter, and the schema of the DCC, need.
ADDRESS = ("name", "street", "post_code", "city", "country")


class MissingFacts(BadInput):
    """Mandatory facts of a certificate are missing; nothing was written."""

    slug = "missing-facts"

    def __init__(self, text: str, facts: Sequence[tuple[str, str]] = ()) -> None:
        super().__init__(text)
        self.facts = list(facts)

    @classmethod
    def of(cls, what: str, facts: Sequence[tuple[str, str]]) -> MissingFacts:
        """Return the error that names every fact with the place where it is stated."""
        places: dict[str, list[str]] = {}
        for fact, place in facts:
            places.setdefault(place, []).append(fact)
        count = "1 fact is missing" if len(facts) == 1 else f"{len(facts)} facts are missing"
        text = "; ".join(f"{', '.join(names)}: {place}" for place, names in places.items())
        return cls(f"no certificate of {what}: {count}. {text}", facts)

    @property
    def members(self) -> JsonObject:
        """Each fact, and where it is stated."""
        return {"missing": [{"fact": fact, "where": place_text} for fact, place_text in self.facts]}


def of_contact(contact: Contact, whose: str, where: str) -> Iterator[tuple[str, str]]:
    """Yield what is missing of an address, and a way to reach it."""
    for name in ADDRESS:
        if not getattr(contact, name):
            yield f"{whose}'s {name.replace('_', ' ')}", where
    if not (contact.email or contact.phone):
        yield f"{whose}'s email or phone", where
