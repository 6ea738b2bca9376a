"""A folder of files in an object store or a file system, by its URL (fsspec)."""

from __future__ import annotations

import errno
from contextlib import suppress
from pathlib import Path
from shlex import quote
from typing import Any
from uuid import uuid4

from labctl.answers.storage_url import EXAMPLES, refused_because
from labctl.errors import BadInput, BadRecording, LabctlError, NotFound
from labctl.extras import needs_extra
from labctl.recording.data_files.damaged_files import reason_of

#: Bytes that are read at a time.
CHUNK_BYTES = 8 << 20
#: Schemes of stores that have no folders: a file is there whole or not at all, and its folder need not be made.
WITHOUT_FOLDERS = frozenset({"abfs", "abfss", "az", "gcs", "gs", "memory", "oci", "oss", "s3", "s3a", "tos"})
#: What the system says where there is no room for a copy.
NO_ROOM = frozenset({errno.ENOSPC, errno.EDQUOT})


class ObjectStorage:
    """Files under a URL, such as s3://bucket/lab or file:///data/lab."""

    def __init__(self, url: str) -> None:
        """Open the storage; nothing is read yet. Raises BadInput where the URL or its scheme cannot be used."""
        if reason := refused_because(url):
            raise BadInput(
                f"the URL of a storage is refused: {reason}; give scheme, place and folder only, as {EXAMPLES}"
            )
        with needs_extra("fleet", f"the storage {url}"):
            import fsspec  # noqa: PLC0415  of the extra `fleet`

        self.url = url.rstrip("/")
        self._has_folders = url.partition("://")[0] not in WITHOUT_FOLDERS
        try:
            opened: tuple[Any, str] = fsspec.url_to_fs(url)
        except ImportError as error:
            raise BadInput(
                f"{url}: its scheme needs a package that is not installed ({error}); install it on each computer that "
                "reads there, as `pip install s3fs` for s3://"
            ) from error
        except ValueError as error:
            raise BadInput(
                f"{url}: {error}; choose a scheme that fsspec knows, such as s3://, gs://, abfs:// or file://"
            ) from error
        except Exception as error:
            raise BadInput(
                f"{url}: cannot be opened ({reason_of(error)}); check the URL and the credentials that its package "
                "reads from the environment"
            ) from error
        self._files, root = opened
        self._root = root.rstrip("/")
        self._files.invalidate_cache()  # of this process, which may have read there before

    def refuse_missing(self) -> None:
        """Raise NotFound where nothing is under the URL, BadInput where that cannot be found out."""
        try:
            exists = bool(self._files.exists(self._root))
            if exists and self._has_folders:  # of a file system that is not mounted the empty folder is left
                exists = bool(self._files.ls(self._root, detail=False))
        except Exception as error:
            raise BadInput(self._unreadable(self.url, error)) from error
        if not exists:
            raise NotFound(
                f"{self.url}: nothing is there; `labctl fleet publish {quote(self.url)}` writes recordings there"
            )

    def size(self, name: str) -> int | None:
        """Return the bytes of a file; None where there is none, or it cannot be read."""
        with suppress(Exception):  # of the packages of all schemes; what reads the file then says what is wrong
            return int(self._files.size(self._path(name)))
        return None

    def fetch(self, name: str, target: Path, max_bytes: int) -> None:
        """Copy a file to `target`. Raises NotFound, BadRecording for one above `max_bytes` or that cannot be read."""
        shown, size = f"{self.url}/{name}", 0
        try:
            with self._files.open(self._path(name), "rb") as source, target.open("wb") as copy:
                while chunk := source.read(CHUNK_BYTES):
                    size += len(chunk)
                    if size > max_bytes:
                        raise BadRecording(
                            f"{shown}: has more than {max_bytes} bytes, the limit for what the database has of it; "
                            "publish it again with --again"
                        )
                    copy.write(chunk)
        except LabctlError:
            raise
        except (FileNotFoundError, NotADirectoryError) as error:
            raise NotFound(
                f"{shown}: there is no such object; `labctl fleet publish {quote(self.url)}` writes what is missing"
            ) from error
        except Exception as error:
            if isinstance(error, OSError) and error.errno in NO_ROOM:
                raise BadRecording(f"{shown}: {target.parent} has no room for a copy; free space there") from error
            raise BadRecording(self._unreadable(shown, error)) from error

    def put(self, name: str, source: Path) -> None:
        """Write a file, whole or not at all, in place of one that is there. Raises BadInput."""
        path = self._path(name)
        part = f"{path}.{uuid4().hex}.part"  # of this process alone: another one may publish the same recording
        try:
            if not self._has_folders:
                self._files.put_file(str(source), path)
                return
            self._files.makedirs(path.rpartition("/")[0], exist_ok=True)
            self._files.put_file(str(source), part)
            self._files.mv(part, path)
        except Exception as error:
            with suppress(Exception):  # it may not be there
                self._files.rm_file(part)
            raise BadInput(
                f"{self.url}/{name}: cannot be written ({reason_of(error)}); check the URL, the free space and the "
                "rights, then publish again: what is there stays"
            ) from error

    def _path(self, name: str) -> str:
        return f"{self._root}/{name}"

    @staticmethod
    def _unreadable(shown: str, error: Exception) -> str:
        return (
            f"{shown}: cannot be read ({reason_of(error)}); check the network, the URL and the credentials in the "
            "environment of the process that reads, then start the job again"
        )
