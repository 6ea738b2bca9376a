"""The schema of the DCC by PTB, where its files are at hand: `LABCTL_DCC_SCHEMA` names their folder."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import xmlschema

SCHEMA = "LABCTL_DCC_SCHEMA"
#: What dcc.xsd imports, and the name of the file.
IMPORTED = {
    "https://ptb.de/si": "SI_Format.xsd",
    "http://qudt.org/vocab/": "qudt.xsd",
    "http://www.w3.org/2000/09/xmldsig#": "xmldsig-core-schema.xsd",
}
needs_schema = pytest.mark.skipif(
    not os.environ.get(SCHEMA), reason=f"{SCHEMA} names no folder with dcc.xsd 3.3.0 of PTB"
)


def schema_objections(xml: bytes) -> list[str]:
    """Return what the schema 3.3.0 objects to."""
    folder = Path(os.environ[SCHEMA])
    locations = {space: str(folder / name) for space, name in IMPORTED.items()}
    schema = xmlschema.XMLSchema10(str(folder / "dcc.xsd"), locations=locations, allow="local")
    assert schema.version == "3.3.0"
    return [str(each) for each in schema.iter_errors(xml.decode())]
