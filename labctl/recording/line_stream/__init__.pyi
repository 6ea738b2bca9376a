from labctl.recording.line_stream.decoder import DecodedLines as DecodedLines, LineDecoder as LineDecoder
from labctl.recording.line_stream.decoder import LineLayout as LineLayout, layout_of as layout_of
