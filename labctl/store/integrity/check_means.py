"""Do the figures that are kept of a data set still follow from its readings?"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import sqlalchemy as sa
from numpy.typing import NDArray

from labctl.store.dataset_statistics import statistics
from labctl.store.repositories.sample_blocks import scaled
from labctl.store.schema import tables

#: Sums differ in their last places by the order in which they are made; figures that were changed differ by more.
ROUNDING = 1e-9


class KeptMeans:
    """The figures kept of one recording's data sets, held against readings."""

    def __init__(self, connection: sa.Connection, recording: int) -> None:
        self.recording = recording
        m, d, r = tables.data_set_means.c, tables.data_sets, tables.recordings.c
        self._channels = connection.scalar(sa.select(r.channels).where(r.id == recording)) or []
        heads = connection.execute(sa.select(d).where(d.c.recording_id == recording)).mappings()
        self._heads = {int(head["number"]): dict(head) for head in heads}
        self._kept: dict[int, list[tuple[str, float, float | None, int]]] = {}
        query = sa.select(m.number, m.channel, m.mean, m.std, m.n).where(m.recording_id == recording)
        for number, channel, mean, std, n in connection.execute(query):
            if mean is not None:
                self._kept.setdefault(int(number), []).append((channel, mean, std, n))

    def complaints(self, number: int, raw: Mapping[str, NDArray[Any]]) -> list[str]:
        """Return what does not follow from the readings of a data set, one line a channel."""
        kept = self._kept.get(number)
        if not kept:
            return []
        sent = (
            {"t_ns", "valid", "chamber_mc", *(channel["name"] for channel in self._channels)}
            if self._channels
            else set()
        )
        if absent := sorted(sent - raw.keys()):
            return [f"its readings lack {', '.join(absent)}"]
        columns = scaled(dict(raw), self._channels, self._heads[number]) if self._channels else raw
        valid = np.asarray(columns["valid"]) != 0 if "valid" in columns else slice(None)
        found = []
        for channel, mean, std, n in kept:
            if channel not in columns:
                found.append(f"{channel} has a mean, and no readings")
                continue
            now = statistics(np.asarray(columns[channel])[valid].astype(np.float64), spectrum=False)
            if now.n != n:
                found.append(f"the mean of {channel} counts {n} readings, there are {now.n}")
            elif not (_same(mean, now.mean) and _same(std, now.std)):
                found.append(
                    f"{channel} is kept as {mean:.9g} +- {std}, its readings come to {now.mean:.9g} +- {now.std}"
                )
        return found


def _same(kept: float | None, now: float | None) -> bool:
    if kept is None or now is None:
        return kept is now
    return bool(np.isclose(kept, now, rtol=ROUNDING, atol=ROUNDING))
