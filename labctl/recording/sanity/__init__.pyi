from labctl.recording.sanity.finding import Finding as Finding, certain as certain
from labctl.recording.sanity.inspection import findings_of as findings_of, inspect_recording as inspect_recording
from labctl.recording.sanity.summary import Summary as Summary, joined as joined, summarise as summarise
from labctl.recording.sanity.within import steps_of as steps_of
