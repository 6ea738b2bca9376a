"""Files of other formats: found by the installed importers, and taken in through the interchange format."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from instruments.plugins import PluginError, PluginGroup, failure, instance_of
from labctl.errors import BadInput, BadRecording, LabctlError
from labctl.recording import Recording, read_recording, write_recording
from labctl.recording.checks import checked, checked_environment
from labctl.recording.column_map import ColumnMap, FileKeys
from labctl.recording.data_files.damaged_files import refuse_computer_errors
from labctl.recording.importer import Importer, TableImporter
from labctl.recording.logs.layout import layout_of
from labctl.recording.logs.recognition import MAX_TEXT_BYTES, head_of, refuse_large, refuse_other
from labctl.recording.raw_table import RawTable
from labctl.recording.sanity.readings import without
from labctl.services.recordings.logs import Accept, MappedFile, given_layout, mapped_file
from labctl.services.recordings.staging import staging_folder
from labctl.services.recordings.time_order import OUT_OF_ORDER, OutOfOrder, leaves_out_rows, refuse_unknown


def _importer(importer: object) -> Importer[Any] | TableImporter[Any]:
    return importer if isinstance(importer, TableImporter) else instance_of(Importer)(importer)


IMPORTERS: PluginGroup[Importer[Any] | TableImporter[Any]] = PluginGroup("labctl.importers", "importer", _importer)
#: The importer of labctl's own format: what it reads is taken in as it is.
INTERCHANGE = "labctl-recording"


@contextmanager
def as_interchange(
    path: Path,
    name: str | None = None,
    options: Sequence[str] = (),
    column_map: ColumnMap | None = None,
    accept: Accept | None = None,
    beside: Sequence[Path] = (),
    leave_out: Sequence[str] = (),
) -> Iterator[Path]:
    """Yield the folder of a recording in the interchange format: the path itself, or one made of what `path` holds.

    `name` is an importer's; without it the importer that is surest. `options` are KEY=VALUE. `column_map` says what the
    columns of a log are; without it one is proposed. `accept` is shown what a log would become, and raises where that
    is not wanted. `beside` are files with further columns of the same run. `leave_out` are kinds of findings whose
    readings are left out. Raises BadInput for an importer or option
    that there is not, BadRecording for what cannot be read.
    """
    given_options = parsed_options(options)
    refuse_unknown(leave_out)
    chosen = name or surest(path)
    if chosen == INTERCHANGE and not given_options:
        if column_map is not None:
            raise _no_map(chosen)
        if beside:
            raise _nothing_beside(chosen)
        if not leave_out:
            yield path
            return
        recording = read_recording(path)
    else:
        in_order = OutOfOrder() if leaves_out_rows(leave_out) else None
        recording = read_with(chosen, path, given_options, column_map, accept, beside, in_order)
    if of_readings := [kind for kind in leave_out if kind != OUT_OF_ORDER]:
        recording = without(recording, of_readings, str(path))
    with staging_folder() as made:
        folder = made / "recording"
        write_recording(recording, folder)
        yield folder


def parsed_options(texts: Sequence[str]) -> dict[str, str]:
    """Return options KEY=VALUE by key; raises BadInput."""
    options: dict[str, str] = {}
    for text in texts:
        key, equals, value = text.partition("=")
        if not equals or not key:
            raise BadInput(f"--option {text}: write KEY=VALUE")
        if key in options:
            raise BadInput(f"--option {text}: {key} is given twice; give it once")
        options[key] = value
    return options


def surest(path: Path) -> str:
    """Return the name of the importer that is surest of a path; raises BadInput for two that are equally sure.

    What no importer knows is left to the one of the interchange format where it is a folder, or not there.
    """
    sure = {name: _confidence(name, importer, path) for name, importer in IMPORTERS.all().items()}
    best = max(sure.values(), default=0.0)
    if best <= 0.0 and path.is_file():
        refuse_large(path, MAX_TEXT_BYTES)
        refuse_other(path, head_of(path))
        layout_of(path, head_of(path), FileKeys())  # says why it is no text with columns
    names = [name for name, confidence in sure.items() if confidence == best]
    if best <= 0.0:
        if path.is_file():
            importer_names = ", ".join(f"{name}: {importer.title}" for name, importer in IMPORTERS.all().items())
            raise BadRecording(
                f"{path}: no installed importer recognises this file (installed: {importer_names}); install the "
                "package "
                "of an importer for it, or name an importer with --format"
            )
        return INTERCHANGE
    if len(names) > 1:
        raise BadInput(
            f"{path}: the importers {' and '.join(names)} recognise the file equally well; choose one with --format"
        )
    return names[0]


def read_with(
    name: str,
    path: Path,
    options: Mapping[str, str],
    column_map: ColumnMap | None = None,
    accept: Accept | None = None,
    beside: Sequence[Path] = (),
    out_of_order: OutOfOrder | None = None,
) -> Recording:
    """Return what an importer reads, checked by the rules of the interchange format; raises BadInput, BadRecording.

    With `out_of_order` a log is read without the rows whose time goes back, and that says which they were.
    """
    importer, given_options = _importer_and_options(name, options)
    plugin = IMPORTERS.plugin(name)
    if not path.exists():
        raise BadRecording(f"{path}: not found; name the file to import")
    if isinstance(importer, Importer) and column_map is not None:
        raise _no_map(name)
    if isinstance(importer, Importer) and beside:
        raise _nothing_beside(name)
    mapped: MappedFile | None = None
    with _failures_named(path, name):
        if isinstance(importer, TableImporter):
            tables = [_table(each, column_map) for each in beside]
            mapped = mapped_file(name, importer, path, given_options, column_map, tables, out_of_order)
        else:
            recording = instance_of(Recording)(importer.read(path, given_options))
    if mapped is not None:
        if accept is not None:
            accept(mapped)
        recording = mapped.recording
    read_by = f"read from {path.name} by importer {name} of {plugin.release}"
    return _checked(path, recording, read_by)


def log_with_map(
    path: Path, name: str | None, options: Mapping[str, str], column_map: ColumnMap | None,
    out_of_order: OutOfOrder | None = None,
) -> MappedFile:  # fmt: skip
    """Return what a log would become, with everything that is wrong with it; raises BadInput, BadRecording.

    With `out_of_order` the rows whose time goes back are left out.
    """
    chosen = name or surest(path)
    importer, given_options = _importer_and_options(chosen, options)
    if not isinstance(importer, TableImporter):
        raise BadInput(f"{path}: importer {chosen} determines the columns itself; import it with `labctl import`")
    with _failures_named(path, chosen):
        return mapped_file(chosen, importer, path, given_options, column_map, (), out_of_order)


@contextmanager
def _failures_named(path: Path, name: str) -> Iterator[None]:
    """Name file and importer in an error that an importer does not explain itself; the computer's own errors pass."""
    try:
        yield
    except (LabctlError, MemoryError):
        raise
    except Exception as error:
        refuse_computer_errors(error)
        raise BadRecording(f"{path}: {failure(IMPORTERS.plugin(name), 'read it', error)}") from error


def _table(path: Path, column_map: ColumnMap | None) -> RawTable:
    """Return the table of a file with further columns; raises BadInput, BadRecording."""
    if not path.exists():
        raise BadRecording(f"{path}: not found; give the path of the file whose columns are to be added")
    name = surest(path)
    importer, given_options = _importer_and_options(name, {})
    if not isinstance(importer, TableImporter):
        raise _nothing_beside(name)
    with _failures_named(path, name):
        return importer.table(path, given_layout(given_options, column_map))


def _nothing_beside(name: str) -> BadInput:
    return BadInput(
        f"--beside: importer {name} reads one file by itself; leave --beside out, or import logs with columns"
    )


def _no_map(name: str) -> BadInput:
    return BadInput(f"--map: importer {name} determines the columns by itself; leave --map out")


def _importer_and_options(name: str, options: Mapping[str, str]) -> tuple[Importer[Any] | TableImporter[Any], Any]:
    try:
        importer = IMPORTERS.get(name)
    except PluginError as error:
        raise BadInput(f"--format {name}: {error}") from error
    try:
        return importer, importer.options.model_validate(dict(options))
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        names = [key for key in importer.options.model_fields if key != "file"]
        option_text = f"its options are {', '.join(names)}" if names else "it has no options"
        raise BadInput(f"importer {name}: option {key}: {first['msg']} ({option_text}); correct the option") from error


def _confidence(name: str, importer: Importer[Any] | TableImporter[Any], path: Path) -> float:
    try:
        return float(importer.probe(path))
    except Exception as error:  # noqa: BLE001  one importer's failure is no reason to ask no other
        IMPORTERS.report(failure(IMPORTERS.plugin(name), f"probe {path}", error))
        return 0.0


def _checked(path: Path, recording: Recording, read_by: str) -> Recording:
    columns = _arrays(path, recording.columns, read_by)
    environment = None if recording.environment is None else _arrays(path, recording.environment, read_by)
    notes = "; ".join(filter(None, (recording.info.notes, read_by)))
    return Recording(
        recording.info.model_copy(update={"notes": notes}),
        checked(path, recording.info, columns),
        None if environment is None else checked_environment(path, environment),
    )


def _arrays(path: Path, columns: Mapping[str, Any], read_by: str) -> dict[str, Any]:
    """Return columns as arrays of one length; raises BadRecording."""
    arrays = {name: np.asarray(values) for name, values in columns.items()}
    shapes = {values.shape for values in arrays.values()}
    if len(shapes) != 1 or len(next(iter(shapes))) != 1 or next(iter(shapes)) == (0,):
        lengths = ", ".join(f"{name}: {'x'.join(map(str, values.shape))}" for name, values in arrays.items())
        raise BadRecording(
            f"{path}: {read_by}: the importer returned columns of different length, or none (lengths: "
            f"{lengths or 'none'}); report this to the author of the importer"
        )
    return arrays
