from instruments.standards import Standard as Standard
from labctl.recording.data_set_limits import refuse_too_many_data_sets as refuse_too_many_data_sets
from labctl.recording.files import read_recording as read_recording, write_recording as write_recording
from labctl.recording.importer import (
    Importer as Importer,
    NoOptions as NoOptions,
    TableImporter as TableImporter,
    TableOptions as TableOptions,
)
from labctl.answers.recording_head import OutputUnit as OutputUnit
from labctl.recording.info import RecordingInfo as RecordingInfo
from labctl.recording.points import dataset_starts as dataset_starts, to_points as to_points
from labctl.recording.raw_table import RawColumn as RawColumn, RawTable as RawTable
from labctl.recording.recording import Columns as Columns, Recording as Recording
