"""A recording in memory, and the interchange format it is read from and written to."""

from instruments.standards import Standard
from labctl.recording.data_set_limits import refuse_too_many_data_sets
from labctl.recording.files import read_recording, write_recording
from labctl.recording.importer import Importer, NoOptions, TableImporter, TableOptions
from labctl.recording.info import OutputUnit, RecordingInfo
from labctl.recording.points import dataset_starts, to_points
from labctl.recording.raw_table import RawColumn, RawTable
from labctl.recording.recording import Columns, Recording

__all__ = [
    "Columns",
    "Importer",
    "NoOptions",
    "OutputUnit",
    "RawColumn",
    "RawTable",
    "Recording",
    "RecordingInfo",
    "Standard",
    "TableImporter",
    "TableOptions",
    "dataset_starts",
    "read_recording",
    "refuse_too_many_data_sets",
    "to_points",
    "write_recording",
]
