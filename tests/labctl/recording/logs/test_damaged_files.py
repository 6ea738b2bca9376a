"""Errors of parsers: about the file in one line, about the computer as they are."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from labctl.errors import BadInput, BadRecording
from labctl.recording.data_files.damaged_files import parsed_by_library

PATH = Path("log.ulg")


def raised_as(error: Exception) -> Exception:
    """Return what becomes of an error that a parser raises."""
    with pytest.raises(Exception) as caught, parsed_by_library(PATH, "ULog file", "take the log off the card again"):  # noqa: PT011
        raise error
    return caught.value


@pytest.mark.parametrize(
    "error",
    [
        OSError(errno.EINVAL, "Invalid argument"),
        FileNotFoundError(errno.ENOENT, "No such file or directory", "b.db3"),
        OSError("Couldn't deserialize thrift"),
        KeyError("x"),
        AssertionError(),
        RecursionError("maximum depth"),
    ],
)
def test_what_broken_bytes_lead_a_parser_to_is_about_the_file(error: Exception) -> None:
    found = raised_as(error)
    assert type(found) is BadRecording
    assert str(found).startswith(f"log.ulg: not a complete ULog file ({type(error).__name__}")
    assert str(found).endswith("; take the log off the card again")


@pytest.mark.parametrize("number", [errno.EIO, errno.ENOSPC, errno.EMFILE, errno.EACCES])
def test_errors_of_the_computer_keep_their_meaning(number: int) -> None:
    error = OSError(number, os.strerror(number), "/tmp/log.ulg")
    assert raised_as(error) is error


@pytest.mark.parametrize("error", [MemoryError(), OSError(errno.ENOMEM, "Cannot allocate memory")])
def test_a_length_that_no_memory_holds_is_about_the_file(error: Exception) -> None:
    found = raised_as(error)
    assert type(found) is BadRecording
    assert "needs more memory than an import may take" in str(found)


def test_a_refusal_by_labctl_passes() -> None:
    error = BadInput("log.ulg: choose an instance")
    assert raised_as(error) is error
