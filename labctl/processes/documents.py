"""What processes of labctl say to each other: JSON documents of declared types, each in a frame of bounded length.

Nothing that arrives is ever unpickled. A process that was taken over can send another one wrong data of the right
types, and no code: the bench process moves a table, and the supervisor stops it.

A frame is the one of `multiprocessing.connection.Connection.send_bytes`: its length, then its bytes. An answer has a
first line that says whether it is a value or an error, and the value or the error in the second.
"""

from __future__ import annotations

from multiprocessing.connection import Connection
from types import GenericAlias
from typing import Any, Generic, TypeVar

import numpy as np
from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic_core import PydanticSerializationError, to_json

from labctl.errors import LabctlError
from labctl.processes.error_documents import ErrorDocument

#: Longest frame, bytes. The largest that is sent is a part of an import (`labctl.store.import_parts`): 2 MiB of packed
#: readings or 2000 rows, and one block of 2 MiB that does not fit with others, a third longer in base 64. A longer
#: one would also keep the process that reads it from its other threads, one of which hears stops.
LONGEST_BYTES = 16 << 20
#: Of it, for the first line.
SPARE_BYTES = 1 << 16
VALUE, RAISED = b"value", b"raised"
#: How many of the characters that were sent a refusal shows.
SHOWN = 60

ValueT = TypeVar("ValueT")


class BadDocument(LabctlError):
    """What arrived is no document, or not of the type that was expected; nothing was done."""

    status = 502
    slug = "bad-document"


class Form(Generic[ValueT]):
    """A type whose values travel as JSON. Bytes are in base 64; numbers that are not finite stay what they are."""

    def __init__(self, kind: Any, name: str) -> None:
        """`kind` is the type; `name` says in errors what its values are, as `the answer to bench.describe`."""
        self.name = name
        # in a list of one: pydantic takes no configuration for a dataclass that stands alone
        alone: Any = GenericAlias(tuple, (kind,))
        self._adapter: TypeAdapter[tuple[ValueT]] = TypeAdapter(alone, config=ConfigDict(val_json_bytes="base64"))

    def encode(self, value: ValueT) -> bytes:
        """Return a value as one line. Raises BadDocument for one that has no form in JSON."""
        try:
            plain = self._adapter.dump_python((value,), exclude_unset=True, round_trip=True, warnings=False)
            document = to_json(plain, bytes_mode="base64", inf_nan_mode="constants", fallback=_plain)
        except (PydanticSerializationError, TypeError, ValueError) as error:
            raise BadDocument(
                f"{self.name} cannot be sent between processes ({error}); report this text and the version of labctl "
                "to its maintainers"
            ) from error
        if len(document) > LONGEST_BYTES - SPARE_BYTES:
            raise BadDocument(
                f"{self.name} has {len(document)} bytes and cannot be sent between processes (limit "
                f"{LONGEST_BYTES - SPARE_BYTES}); send less at a time"
            )
        return document

    def decode(self, document: bytes) -> ValueT:
        """Return the value of a document. Raises BadDocument for one of another type, or that is no JSON."""
        try:
            return self._adapter.validate_json(document)[0]
        except ValidationError as error:
            first = error.errors(include_url=False, include_input=False)[0]
            where = ".".join(str(part) for part in first["loc"][1:])
            raise BadDocument(
                f"{self.name} is not as expected{f' at {where}' if where else ''}: {first['msg']} "
                f"(received {_shown(document)}, {len(document)} bytes); stop the service and start it again, so that "
                "all its processes have one version of labctl"
            ) from error


def _plain(value: object) -> object:
    """Return a number of numpy as one of Python. Raises TypeError for anything else."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a value of the type {type(value).__name__} has no form in JSON")


def _shown(document: bytes) -> str:
    text = document[:SHOWN].decode("ascii", "backslashreplace")
    return ascii(text + ("..." if len(document) > SHOWN else ""))


_ERROR: Form[ErrorDocument] = Form(ErrorDocument, "the error of another process")


def answer(form: Form[ValueT], value: ValueT) -> bytes:
    """Return the document of an answer. Raises BadDocument for a value that has no form in JSON."""
    return VALUE + b"\n" + form.encode(value)


def refusal(error: BaseException) -> bytes:
    """Return the document of an answer by what was raised."""
    return RAISED + b"\n" + _ERROR.encode(ErrorDocument.of(error))


def value_of(form: Form[ValueT], document: bytes) -> ValueT:
    """Return the value of an answer, or raise the error in it. Raises BadDocument for what is no answer."""
    kind, _, content = document.partition(b"\n")
    if kind == RAISED:
        raise _ERROR.decode(content).error()
    if kind != VALUE:
        raise BadDocument(
            f"{form.name} is no answer (received {_shown(document)}, {len(document)} bytes); stop the service and "
            "start it again, so that all its processes have one version of labctl"
        )
    return form.decode(content)


def receive(line: Connection, longest: int = LONGEST_BYTES) -> bytes:
    """Return the next frame.

    Raises EOFError where the other end has closed the line between two frames, OSError where it broke, BadDocument for
    a frame that is longer than `longest`, bytes, or that ended before it was whole. No frame can follow such a one.
    """
    try:
        return line.recv_bytes(longest)
    except OSError as error:
        if error.errno is not None:
            raise
        raise BadDocument(
            f"a frame of another process is not whole or longer than {longest} bytes ({error}); stop the service and "
            "start it again, so that all its processes have one version of labctl"
        ) from error
