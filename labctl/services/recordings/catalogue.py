"""The catalogue of recordings, and their data sets as columns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from labctl.answers.recording_head import RecordingKind
from labctl.answers.recordings import (
    ChannelColumns,
    DataSetsResponse,
    RecordingAlone,
    RecordingOrigin,
    RecordingResponse,
    RecordingWithPoints,
    SamplesResponse,
)
from labctl.recording import Recording
from labctl.recording.columns import RATE_TIME_U
from labctl.services.benches.bench_clock import has_simulated_time
from labctl.store import MeanRow, RecordingRow, Store
from labctl.store.paging import Page, PageRequest


def page_of_recordings(
    store: Store, request: PageRequest[int], serial: str | None = None, kind: RecordingKind | None = None
) -> Page[RecordingResponse, int]:
    """Return recordings, newest first, as many as are asked for: all, those of a unit, of a kind."""
    page = store.recordings.page(request, serial, kind)
    simulated = _of_simulated_time(store, page.rows)
    origins = _origins(store, page.rows)
    campaigns = _campaigns_of(page.rows)
    unfinished, experiments = store.campaigns.not_ended(campaigns), store.diagnoses.experiments(campaigns)
    lines = [
        RecordingResponse(
            id=row.id, serial=row.serial, kind=row.kind, campaign=row.campaign, datasets=row.datasets,
            readings=row.readings, created_at=row.created_at, notes=str(row.info.get("notes") or ""),
            motion=row.recording_info.motion, simulated_time=row.campaign in simulated, origin=origins[row.id],
            unfinished=row.campaign in unfinished, experiment=row.campaign in experiments,
        )
        for row in page.rows
    ]  # fmt: skip
    return Page(lines, page.total, page.next_after)


def _origins(store: Store, rows: Sequence[RecordingRow]) -> dict[int, RecordingOrigin]:
    """Return what made each of some recordings, by its number."""
    alone = [row.id for row in rows if row.campaign is None]
    made = store.audit.simulated_recordings(alone) if alone else set()
    return {
        row.id: "campaign" if row.campaign is not None else "simulation" if row.id in made else "import" for row in rows
    }


def _of_simulated_time(store: Store, rows: Sequence[RecordingRow]) -> set[int | None]:
    """Return the campaigns of these recordings that ran on a simulated clock."""
    benches = store.campaigns.benches(_campaigns_of(rows))
    return {number for number, bench in benches.items() if has_simulated_time(bench)}


def _campaigns_of(rows: Sequence[RecordingRow]) -> list[int]:
    return sorted({row.campaign for row in rows if row.campaign is not None})


def data_sets(store: Store, recording: int) -> DataSetsResponse:
    """Return the data sets of a recording as columns; none for a table of coefficients. Raises NotFound."""
    head = store.recordings.get(recording)
    rows = store.recordings.data_sets(recording)
    numbers = [row.number for row in rows]
    if head.kind == "samples":
        channels = _of_rows(numbers, store.recordings.means(recording))
    else:
        channels = _of_table(numbers, store.recordings.points(recording)) if rows else {}
    return DataSetsResponse(
        recording=recording,
        number=numbers,
        state=[row.state for row in rows],
        reason=[row.reason for row in rows],
        position=[row.position for row in rows],
        run=[row.run for row in rows],
        mounting=[row.mounting for row in rows],
        table_rate_dps=[row.table_rate_dps for row in rows],
        t_from_s=[row.t_from_s for row in rows],
        t_until_s=[row.t_until_s for row in rows],
        n=[row.n for row in rows],
        lost=[row.lost for row in rows],
        damaged=[row.damaged for row in rows],
        verification=[row.verification for row in rows],
        chamber_setpoint_c=[row.chamber_setpoint_c for row in rows],
        channels=channels,
    )


def _of_rows(numbers: list[int], means: list[MeanRow]) -> dict[str, ChannelColumns]:
    place = {number: k for k, number in enumerate(numbers)}
    by_column: dict[str, tuple[list[float | None], list[float | None]]] = {}
    for row in means:
        mean, std = by_column.setdefault(row.channel, ([None] * len(numbers), [None] * len(numbers)))
        mean[place[row.number]], std[place[row.number]] = row.mean, row.std
    return {name: ChannelColumns(mean=mean, std=std) for name, (mean, std) in by_column.items()}


#: Columns of a table of points that identify a data set, or describe its mean.
NO_CHANNEL = frozenset(
    {
        "dataset", "t_s", "position", "run", "mounting", "table_rate_dps", "computed_rate_dps", "encoder_rate_u_dps",
        *RATE_TIME_U, "n", "duration_s", "valid",
    }
)  # fmt: skip


def _of_table(numbers: list[int], points: Recording) -> dict[str, ChannelColumns]:
    """Return the figures of points that were imported as points, from their own columns."""
    order = np.argsort(np.asarray(points.columns["dataset"]), kind="stable")
    nothing: list[float | None] = [None] * len(numbers)
    by_name: dict[str, ChannelColumns] = {}
    for name, values in points.columns.items():
        if name in NO_CHANNEL or name.endswith("_std") or np.asarray(values).dtype.kind not in "fiu":
            continue
        spread = points.columns.get(f"{name}_std")
        std = nothing if spread is None else _numbers(np.asarray(spread, dtype=np.float64)[order])
        by_name[name] = ChannelColumns(mean=_numbers(np.asarray(values, dtype=np.float64)[order]), std=std)
    return by_name


def _numbers(values: NDArray[np.float64]) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]


def describe_recording(store: Store, recording: int, *, points: bool = True) -> RecordingAlone | RecordingWithPoints:
    """Return what a recording is and, if asked for, the means of its data sets."""
    row = store.recordings.get(recording)
    about = RecordingAlone(
        id=row.id,
        serial=row.serial,
        campaign=row.campaign,
        origin=_origins(store, [row])[row.id],
        kind=row.kind,
        info=dict(row.info),
        created_at=row.created_at.isoformat(),
        simulated_time=row.campaign is not None and has_simulated_time(store.campaigns.get(row.campaign).bench),
        datasets=row.datasets,
        readings=row.readings,
    )
    if not points:
        return about
    columns = store.recordings.points(recording).columns
    return RecordingWithPoints(
        **dict(about), points={name: np.asarray(values).tolist() for name, values in columns.items()}
    )


def dataset_samples(store: Store, recording: int, dataset: int, limit: int) -> SamplesResponse:
    """Return the readings of one data set, at most `limit`."""
    columns = store.recordings.dataset(recording, dataset)
    n = len(next(iter(columns.values()), ()))
    return SamplesResponse(
        recording=recording,
        dataset=dataset,
        readings=n,
        columns={name: np.asarray(values)[:limit].tolist() for name, values in columns.items()},
    )
