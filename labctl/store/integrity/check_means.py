"""Do the figures that are kept of a data set still follow from its readings?"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import sqlalchemy as sa
from numpy.typing import NDArray

from labctl.store.dataset_statistics import statistics
from labctl.store.repositories.sample_blocks import head_of, join_blocks, scaled
from labctl.store.schema import tables

#: Sums differ in their last places by the order in which they are made; figures that were changed differ by more.
ROUNDING = 1e-9


class MeansCheck:
    """Compares what is kept of each data set with its readings, whose blocks come in order."""

    def __init__(self, connection: sa.Connection) -> None:
        self._connection = connection
        self._kept: KeptMeans | None = None
        self._place = (0, 0)
        self._parts: list[dict[str, NDArray[np.generic]]] = []
        self._damaged = False

    def take(self, recording: int, number: int, columns: dict[str, NDArray[np.generic]] | None) -> list[str]:
        """Take one block, None for a damaged one; returns what is wrong with the data set before, if that was its end.

        A data set with a damaged block has its own finding.
        """
        complaints: list[str] = []
        if (recording, number) != self._place:
            complaints = self.rest()
            self._place = (recording, number)
        self._damaged |= columns is None
        self._parts += [columns] if columns is not None else []
        return complaints

    def rest(self) -> list[str]:
        """Return what is wrong with the data set whose blocks came last, one line a channel."""
        (recording, number), parts, damaged = self._place, self._parts, self._damaged
        self._parts, self._damaged = [], False
        if damaged or not parts:
            return []
        if self._kept is None or self._kept.recording != recording:
            self._kept = KeptMeans(self._connection, recording)
        place_text = f"recording {recording} data set {number}"
        if any(part.keys() != parts[0].keys() for part in parts):
            return [f"{place_text}: the blocks of this data set have different columns"]
        return [f"{place_text}: {text}" for text in self._kept.complaints(number, join_blocks(parts))]


class KeptMeans:
    """The figures kept of one recording's data sets, compared with readings."""

    def __init__(self, connection: sa.Connection, recording: int) -> None:
        self.recording = recording
        m, d, r = tables.data_set_means.c, tables.data_sets, tables.recordings.c
        self._channels = connection.scalar(sa.select(r.channels).where(r.id == recording)) or []
        heads = connection.execute(sa.select(d).where(d.c.recording_id == recording)).mappings()
        self._heads = {int(head["number"]): head_of(head) for head in heads}
        self._kept: dict[int, list[tuple[str, float, float | None, int]]] = {}
        query = sa.select(m.number, m.channel, m.mean, m.std, m.n).where(m.recording_id == recording)
        for number, channel, mean, std, n in connection.execute(query):
            if mean is not None:
                self._kept.setdefault(int(number), []).append((channel, mean, std, n))

    def complaints(self, number: int, raw: Mapping[str, NDArray[np.generic]]) -> list[str]:
        """Return what does not follow from the readings of a data set, one line a channel."""
        kept_means = self._kept.get(number)
        if not kept_means:
            return []
        sent = (
            {"t_ns", "valid", "chamber_mc", *(channel["name"] for channel in self._channels)}
            if self._channels
            else set()
        )
        if absent := sorted(sent - raw.keys()):
            return [f"the readings have no column {', '.join(absent)}"]
        columns = scaled(dict(raw), self._channels, self._heads[number]) if self._channels else raw
        valid = np.asarray(columns["valid"]) != 0 if "valid" in columns else slice(None)
        damages = []
        for channel, mean, std, n in kept_means:
            if channel not in columns:
                damages.append(f"the readings have no column {channel}, but its mean is stored")
                continue
            now = statistics(np.asarray(columns[channel])[valid].astype(np.float64), spectrum=False)
            if now.n != n:
                damages.append(f"the stored mean of {channel} is of {n} readings, but {now.n} readings are stored")
            elif not (_same(mean, now.mean) and _same(std, now.std)):
                damages.append(
                    f"the stored mean of {channel} is {mean:.9g} +- {std}, but the readings give {now.mean:.9g} +- "
                    f"{now.std}"
                )
        return damages


def _same(stored: float | None, now: float | None) -> bool:
    if stored is None or now is None:
        return stored is now
    return bool(np.isclose(stored, now, rtol=ROUNDING, atol=ROUNDING))
