"""Readings of a stream in memory, in arrays that grow; what was taken out of them stays as it was."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput
from labctl.recording import Recording, RecordingInfo
from labctl.recording.columns import holds_flags, needed

#: Readings that the arrays begin with.
FIRST = 4096


class ReadingBuffer:
    """The columns of a recording that begins."""

    def __init__(self, info: RecordingInfo) -> None:
        self._info = info
        self._columns: dict[str, NDArray[np.generic]] = {}
        self._n = 0

    def __len__(self) -> int:
        return self._n

    def add(self, columns: Mapping[str, NDArray[np.generic]]) -> None:
        """Append a block, (n,) each. Raises BadInput for columns that are missing or differ, and for times that fall.

        Data set 1 is all of it.
        """
        n = len(columns["t_s"]) if "t_s" in columns else 0
        given = {"dataset": np.ones(n, dtype=np.int64), **columns}
        serial = self._info.serial
        if not self._columns:
            if absent := [name for name in needed(self._info) if name not in given]:
                raise BadInput(
                    f"{serial}: the stream has no {', '.join(absent)}; add rates and specific forces of all three axes"
                )
            self._columns = {name: np.zeros(FIRST, dtype=_type(name)) for name in given}
        if set(given) != set(self._columns) or any(len(values) != n for values in given.values()):
            raise BadInput(f"{serial}: a block has other columns than those before it; send the same columns each time")
        if n == 0:
            return
        times = np.asarray(given["t_s"], dtype=np.float64)
        last = float(np.asarray(self._columns["t_s"])[self._n - 1]) if self._n else -np.inf
        if not np.all(np.diff(np.concatenate([[last], times])) > 0):
            raise BadInput(f"{serial}: t_s does not rise after {max(last, 0.0):.6f} s; send readings in order of time")
        self._grow(self._n + n)
        for name, values in given.items():
            self._columns[name][self._n : self._n + n] = values
        self._n += n

    def recording(self) -> Recording:
        """Return all readings so far; later ones do not change it."""
        n = self._n
        return Recording(self._info, {name: values[:n] for name, values in self._columns.items()} or _none(self._info))

    def _grow(self, n: int) -> None:
        room = len(self._columns["t_s"])
        if n > room:
            size = max(2 * room, n)
            self._columns = {
                name: np.concatenate([values[: self._n], np.zeros(size - self._n, dtype=values.dtype)])
                for name, values in self._columns.items()
            }


def _type(name: str) -> type[np.generic]:
    return np.int64 if name == "dataset" or holds_flags(name) else np.float64


def _none(info: RecordingInfo) -> dict[str, NDArray[np.generic]]:
    return {name: np.zeros(0, dtype=_type(name)) for name in needed(info)}
