"""Readings as lines of text that arrive one by one: JSON objects, or CSV with or without a header."""

from labctl.recording.line_stream.decoder import DecodedLines, LineDecoder
from labctl.recording.line_stream.layout import LineLayout, layout_of

__all__ = ["DecodedLines", "LineDecoder", "LineLayout", "layout_of"]
