"""Column maps: how the columns of any log become those of a recording; read, proposed, and applied."""

from labctl.recording.column_map.document import checked_map, map_document, map_text, parse_map, read_map
from labctl.recording.column_map.model import ColumnMap, FileKeys
from labctl.recording.column_map.proposal import Proposal, completed, propose
from labctl.recording.column_map.recording import MappedLog, recording_of

__all__ = [
    "ColumnMap",
    "FileKeys",
    "MappedLog",
    "Proposal",
    "checked_map",
    "completed",
    "map_document",
    "map_text",
    "parse_map",
    "propose",
    "read_map",
    "recording_of",
]
