"""The means of a campaign that still runs, as a fit takes them: what a data set's readings say is computed once."""

from __future__ import annotations

from labctl.recording import Recording, to_points
from labctl.recording.points import with_pieces
from labctl.recording.sanity import Summary, joined, steps_of, summarise
from labctl.services.recordings.loading import with_steps
from labctl.store import Store


class RunningPoints:
    """The means of one recording, as `points_of` returns them, which would read all readings after each data set."""

    def __init__(self, store: Store, recording: int) -> None:
        self._store, self._recording = store, recording
        self._summaries: dict[int, Summary] = {}
        self._pieces: dict[int, Recording] = {}

    def read(self) -> Recording:
        """Return the means of the data sets that are complete now."""
        points = self._store.recordings.points(self._recording)
        info = points.info.model_copy(update={"kind": "samples"})

        def readings_of(number: int) -> Recording:
            return Recording(info, self._store.recordings.dataset(self._recording, number))

        def pieces_of(number: int) -> Recording:
            if number not in self._pieces:
                self._pieces[number] = to_points(readings_of(number))
            return self._pieces[number]

        numbers = [int(number) for number in points.columns["dataset"]]
        for number in numbers:
            if number not in self._summaries:
                self._summaries[number] = summarise(readings_of(number))
        summary = joined(info, [self._summaries[number] for number in numbers])
        quantisation: dict[str, list[float]] = {}
        for axis in info.axes if len(summary) else ():
            step, u_dps = steps_of(summary, axis)
            if step is not None:
                quantisation[axis] = u_dps.tolist()
        return with_steps(with_pieces(points, pieces_of), summary["dataset"].tolist(), quantisation)
