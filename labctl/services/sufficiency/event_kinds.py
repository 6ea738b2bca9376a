"""Kinds of the events that say U of a running campaign."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from labctl.answers.sufficiency import Known

#: What is known of U -> kind of event.
KINDS: Mapping[Known, str] = MappingProxyType(
    {"of the fit": "uncertainty", "at least": "uncertainty_bound", "unknown": "uncertainty_unknown"}
)
#: Kind of event -> what is known of U.
KNOWN: Mapping[str, Known] = MappingProxyType({kind: known for known, kind in KINDS.items()})
