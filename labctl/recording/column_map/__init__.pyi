from labctl.recording.column_map.document import (
    checked_map as checked_map,
    map_document as map_document,
    map_text as map_text,
    parse_map as parse_map,
    read_map as read_map,
)
from labctl.recording.column_map.model import ColumnMap as ColumnMap, FileKeys as FileKeys
from labctl.recording.column_map.proposal import Proposal as Proposal, completed as completed, propose as propose
from labctl.recording.column_map.recording import MappedLog as MappedLog, recording_of as recording_of
