"""A recording as one file to take away: the interchange format in a zip."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Literal
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile

from labctl.services.recordings.transfer import export_recording
from labctl.store import Store

CHUNK_BYTES = 1 << 20
#: CSV shrinks to a fifth at the quickest; Parquet is packed already.
EFFORT = 1


@dataclass(frozen=True)
class Download:
    """A file without a name on the disk: it goes when it is closed, or with the process."""

    name: str
    size: int
    content: IO[bytes]

    def chunks(self) -> Iterator[bytes]:
        """Yield the bytes, then close the file; also when whoever reads goes away."""
        with self.content:
            while chunk := self.content.read(CHUNK_BYTES):
                yield chunk


def zip_recording(store: Store, recording: int, file_format: Literal["parquet", "csv"]) -> Download:
    """Return a recording in the interchange format as a zip with one folder. Raises NotFound."""
    name = f"recording-{recording}"
    with tempfile.TemporaryDirectory(prefix="labctl-export-") as made:
        folder = Path(made) / name
        written = export_recording(store, recording, folder, file_format)
        target = tempfile.TemporaryFile(prefix="labctl-export-")  # noqa: SIM115  closed by whoever sends it
        try:
            packing = ZIP_DEFLATED if file_format == "csv" else ZIP_STORED
            with ZipFile(target, "w", packing, compresslevel=EFFORT) as archive:
                for file in written:
                    archive.write(folder / file, f"{name}/{file}")
                    (folder / file).unlink()
            size = target.tell()
            target.seek(0)
        except BaseException:
            target.close()
            raise
    return Download(f"{name}.zip", size, target)
