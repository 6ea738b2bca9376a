"""How long tests wait for what an idle machine does at once: a busy machine is slow, not wrong."""

from __future__ import annotations

#: For an answer, an event, the end of a process: longer only where none will come.
WAIT_S = 240.0
