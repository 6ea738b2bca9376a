"""Computations: carried out in the threads of this process, or in a bounded pool of worker processes."""

from labctl.services.computation.computation import Computation
from labctl.services.computation.in_threads import InThreads
from labctl.services.computation.in_workers import InWorkers
from labctl.services.computation.job import Pending
from labctl.services.computation.limits import Limits

__all__ = ["Computation", "InThreads", "InWorkers", "Limits", "Pending"]
