"""Errors of the libraries that parse files, as one clear line about the file; those of the computer stay what they are.

A parser raises whatever broken bytes lead it to: of any class, OSError too where they say to seek before the beginning
of the file, or name another file that is not there.
"""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from labctl.errors import BadRecording, LabctlError

#: What the system says of its disks, rights and tables, and never of a file's content.
OF_THE_COMPUTER = frozenset(
    {
        errno.EACCES, errno.EDQUOT, errno.EIO, errno.EMFILE, errno.ENFILE, errno.ENODEV, errno.ENOSPC, errno.EPERM,
        errno.EROFS, errno.ESTALE, errno.ETIMEDOUT,
    }
)  # fmt: skip
#: What a library says of a file is shown up to here.
LONGEST_REASON = 200


@contextmanager
def parsed_by_library(path: Path, kind: str, advice: str) -> Iterator[None]:
    """Run a library's parser of a file.

    `kind` is what the file should be, such as "ULog file", `advice` what to do about one that is damaged. Raises
    BadRecording for whatever the parser raises about the content, also where a damaged length asks for more memory
    than there is; errors of labctl, and OSError about the computer itself (disk full, a disk that cannot be read, too
    many open files) pass.
    """
    try:
        yield
    except LabctlError:
        raise
    except Exception as error:
        refuse_computer_errors(error)
        if is_of_memory(error):
            raise BadRecording(
                f"{path}: needs more memory than an import may take; divide the recording; if it is damaged, {advice}"
            ) from error
        raise BadRecording(f"{path}: not a complete {kind} ({reason_of(error)}); {advice}") from error


def refuse_computer_errors(error: Exception) -> None:
    """Raise an error again that is about the computer and not about a file's content."""
    if isinstance(error, OSError) and error.errno in OF_THE_COMPUTER:
        raise error


def is_of_memory(error: Exception) -> bool:
    """Whether an error says that there is no memory: also for a file that is mapped into it."""
    return isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == errno.ENOMEM)


def reason_of(error: Exception) -> str:
    """Return class and text of an error in one line."""
    return f"{type(error).__name__}: {' '.join(str(error).split())[:LONGEST_REASON]}".rstrip(": ")
