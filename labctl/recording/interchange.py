"""labctl's own importer: of the interchange format."""

from __future__ import annotations

from pathlib import Path

from labctl.recording.files import HEAD, read_recording
from labctl.recording.importer import Importer, NoOptions
from labctl.recording.recording import Recording


def probe(path: Path) -> float:
    """Return 1 for a folder with recording.toml."""
    return float((path / HEAD).is_file())


def read(path: Path, _: NoOptions) -> Recording:
    """Return the recording of a folder; raises BadRecording."""
    return read_recording(path)


IMPORTER = Importer("a folder in the interchange format", probe, read, NoOptions)
