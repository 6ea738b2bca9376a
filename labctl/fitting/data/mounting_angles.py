"""Angles of the mountings: what fixture and table top lean by, apart from the unit's misalignment where it can be seen.

A unit turns about body axis o. In a mounting its axis of rotation leans, in the frame of the unit, by the angle f of
the fixture's face, turned back by the angle u of the unit on it, by the angle t of the table top, turned back by u and
the angle v of the fixture on the table, and by how well it was placed this time. An output across o shows over the
table's rate

    s m + cos(u) f_c + sin(u) f_s + cos(u + v) t_c + sin(u + v) t_s

with s = 1 or -1 for the end of o that points up, m the misalignment towards o, and angles f and t of this end. With one
mounting nothing of this is separated, and m has the angles in full. The two ends of o separate the sum of their angles,
half the difference stays in m. A unit turned by 180 deg on its face separates all of them. What is different in each
mounting, because a unit is never placed alike, is a random effect of the size that the bench states.

A tilted mounting, with a direction d of the body along the table axis, shows an output o the rate (K d)_o + a_o, where
a is what its own axis of rotation leans by. Where the straight mountings have each body axis up, they determine the
matrix K, and each output takes a_o of every tilted mounting beside it: no error of the tilted fixture is then in a
coefficient. Else the angles are part of what is fitted (`labctl.fitting.data.tilted_mountings`).

Several recordings may be of several benches, whose angles are not the same: nothing is separated there, and the shifts
between mountings (`shifts`) have the angles.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.data.joined import recordings_in
from labctl.fitting.numeric.arrays import Array, block_diagonal
from labctl.recording import Standard
from labctl.recording.positions import Position

#: Standard deviation of an angle before anything was measured, rad: far above that of any fixture.
WIDE_RAD = 0.1
#: Standards whose errors are angles of the mountings.
ANGLE_QUANTITIES = ("fixture_angle", "tilt", "mounting_repeatability")
#: What stays below the turned part, and the two components of its angle.
PARTS, WAVES = ("fixture", "table"), ("cos", "sin")
#: End of the name of what a single mounting is off by.
PLACED = " placed"
#: Shares of a singular value below which a direction is not seen.
UNSEEN = 1e-9


@dataclass(frozen=True)
class AngleGains:
    """How the misalignment towards a body axis follows the angles of its mountings, radians per radian each."""

    fixture: float = 1.0  #: of an angle of each face
    table: float = 1.0  #: of the table top
    mounting: float = 1.0  #: of each single mounting
    tilted: float = 0.0  #: of the tilted fixture

    def of(self, quantity: str) -> float:
        """Return the gain for a quantity of the bench's standards."""
        return {
            "fixture_angle": self.fixture, "tilt": self.table, "mounting_repeatability": self.mounting,
            "tilted_fixture_angle": self.tilted,
        }[quantity]  # fmt: skip


@dataclass(frozen=True)
class _Scheme:
    """The p mountings with one body axis along the table axis, and which combinations of the l angles they separate."""

    positions: tuple[Position, ...]
    names: tuple[str, ...]  #: of the l angles
    sign: Array  #: (p,): of the misalignment
    angles: NDArray[np.float64]  #: (p, l): what each mounting shows of each angle
    separated: NDArray[np.float64]  #: (l, k): orthonormal combinations that are separated from the misalignment

    @property
    def separates(self) -> bool:
        """Whether any angle is separated from the misalignment."""
        return self.separated.shape[1] > 0

    def gains(self, shares: Mapping[str, float]) -> AngleGains:
        """Return the gains of a fit to so much of each position: the weighted least squares of the mountings."""
        root = np.sqrt([shares[str(position)] for position in self.positions])
        design = root[:, None] * np.column_stack([self.sign, self.angles @ self.separated])
        pseudo_inverse = np.linalg.pinv(design, rcond=UNSEEN)[0] * root
        of = pseudo_inverse @ self.angles
        of[np.abs(of) < UNSEEN] = 0.0
        size = {part: float(np.linalg.norm(of[[part in name for name in self.names]])) for part in PARTS}
        return AngleGains(size["fixture"], size["table"], float(np.linalg.norm(pseudo_inverse)))


@dataclass(frozen=True)
class AngleColumns:
    """Regressors of what the mountings of some rows separate, beside the misalignments of one output."""

    names: tuple[str, ...]  #: of the l angles
    combined: NDArray[np.float64]  #: (l, k)
    values: NDArray[np.float64]  #: (n, k) deg/s per radian
    size: Array  #: (k,) standard deviation before the measurement, rad

    @classmethod
    def none(cls, rows: int) -> AngleColumns:
        """No angle is separated, in so many rows."""
        return cls((), np.zeros((0, 0)), np.zeros((rows, 0)), np.zeros(0))

    def __len__(self) -> int:
        """Return k."""
        return self.values.shape[1]

    def angles_rad(self, coefficients: Array) -> dict[str, float]:
        """Return the angles by name, rad, for coefficients of the columns (k,)."""
        return dict(zip(self.names, (self.combined @ coefficients).tolist(), strict=True))


def angle_columns(channels: Channels, axis: str, placed_rad: float = 0.0) -> AngleColumns:
    """Return the regressors of one output: of the mountings in which the table turned it about another axis.

    `placed_rad` is the standard deviation by which one mounting differs from the same another time (`placed_rad`).
    """
    if len(recordings_in(channels.columns)) > 1:
        return AngleColumns.none(len(channels))
    names: list[str] = []
    values, blocks, sizes = [np.zeros((len(channels), 0))], [], [np.zeros(0)]
    for scheme in _schemes(turned_positions(channels), axis):
        if not scheme.separates:
            continue
        placed = [f"{position}{PLACED}" for position in scheme.positions] if placed_rad else []
        regressors = np.column_stack([angle_regressor(channels, name) for name in (*scheme.names, *placed)])
        names += [*scheme.names, *placed]
        blocks.append(block_diagonal([scheme.separated, np.eye(len(placed))]))
        values.append(regressors @ blocks[-1])
        sizes += [np.full(scheme.separated.shape[1], WIDE_RAD), np.full(len(placed), placed_rad)]
    for position in tilted_beside(turned_positions(channels)):
        names.append(_tilt_of(position))
        blocks.append(np.eye(1))
        values.append(angle_regressor(channels, names[-1])[:, None])
        sizes.append(np.full(1, WIDE_RAD))
    combined = block_diagonal(blocks)
    return AngleColumns(tuple(names), combined, np.concatenate(values, axis=1), np.concatenate(sizes))


def placed_rad(standards: Iterable[Standard]) -> float:
    """Return the standard deviation by which a mounting differs from the same another time, rad; 0 where not stated."""
    return stated_rad(standards, ("mounting_repeatability",))


def stated_rad(standards: Iterable[Standard], quantities: Collection[str]) -> float:
    """Return the standard deviation of angles that are stated, deg, taken together, rad; 0 where none is stated."""
    return math.radians(math.hypot(*(standard.standard_u for standard in standards if standard.quantity in quantities)))


def leaning_rates(channels: Channels, angles_rad: Mapping[str, Mapping[str, float]]) -> dict[str, Array]:
    """Return the true rates about the body axes, (n,) deg/s, of a unit whose mountings have angles towards axes, rad.

    Rows show the angles of their own mounting, whichever of the mountings they hold.
    """
    rates = dict(channels.rates)
    for towards, named in angles_rad.items():
        for name, angle_rad in named.items():
            if angle_rad:
                rates[towards] = rates[towards] + angle_rad * angle_regressor(channels, name)
    return rates


def angle_regressor(channels: Channels, name: str) -> Array:
    """Return what rows show of one angle, (n,) deg/s per radian, whichever of its mountings they hold."""
    regressor = np.zeros(len(channels))
    for text, rows in channels.positions():
        position = Position.of(text)
        if name in {f"{position}{PLACED}", _tilt_of(position)}:
            regressor[rows] = 1.0
        elif name in _names(position):
            regressor[rows] = _shown(position, (name,))[0]
    return np.asarray(regressor * channels.table_rate_dps())


def turned_positions(channels: Channels) -> tuple[str, ...]:
    """Return the positions in which the table turned."""
    is_turning = channels.table_rate_dps() != 0
    return tuple(position for position, rows in channels.positions() if np.any(is_turning & rows))


def mountings_of(channels: Channels) -> dict[str, float]:
    """Return position -> the share of its data sets in what is known of slopes over the rate: squares of the rate.

    Of several recordings nothing: each may have been on another fixture.
    """
    if len(recordings_in(channels.columns)) > 1:
        return {}
    squares = channels.table_rate_dps() ** 2
    return shares_of({position: float(squares[rows].sum()) for position, rows in channels.positions()})


def shares_of(weights: Mapping[str, float]) -> dict[str, float]:
    """Return position -> its share in the whole, of positions with a weight."""
    whole = sum(weights.values())
    return {position: weight / whole for position, weight in weights.items() if weight > 0}


def angle_gains(shares: Mapping[str, float], axis: str, *, separates: bool = True) -> AngleGains:
    """Return the gains for a body axis of positions with so much in the slopes over the rate; all 1 without any.

    Where nothing `separates` the angles, the slope is that of a line through all mountings.
    """
    return _angle_gains(tuple(shares.items()), axis, separates)


@lru_cache(maxsize=256)
def _angle_gains(shares: tuple[tuple[str, float], ...], axis: str, separates: bool) -> AngleGains:
    gains: dict[str, float] = {}
    for text, share in shares:
        gains[str(Position.of(text))] = gains.get(str(Position.of(text)), 0.0) + share
    scheme = _scheme(tuple(sorted(gains)), axis)
    if scheme is None:
        return AngleGains()
    if not separates:
        none = np.zeros((len(scheme.names), 0))
        scheme = _Scheme(scheme.positions, scheme.names, scheme.sign, scheme.angles, none)
    return scheme.gains(gains)


def separates_any(positions: Iterable[str], axis: str) -> bool:
    """Return whether the mountings with a body axis along the table axis separate an angle from the misalignment."""
    scheme = _scheme(tuple(sorted(positions)), axis)
    return scheme is not None and scheme.separates


def _schemes(positions: tuple[str, ...], axis: str) -> Iterable[_Scheme]:
    schemes = (_scheme(positions, other) for other in BODY_AXES if other != axis)
    return [scheme for scheme in schemes if scheme is not None]


@cache
def _scheme(positions: tuple[str, ...], axis: str) -> _Scheme | None:
    """Return the mountings with a body axis along the table axis; None without any."""
    about = tuple(p for p in map(Position.of, positions) if p.axis == axis)
    if not about:
        return None
    names = tuple(sorted({name for position in about for name in _names(position)}))
    sign = np.array([position.sign for position in about])
    angles = np.array([_shown(position, names) for position in about])
    return _Scheme(about, names, sign, angles, _separated(sign, angles))


def tilted_beside(positions: Iterable[str]) -> list[Position]:
    """Return the tilted mountings beside straight ones that have each body axis up; none where one has not."""
    every = [Position.of(position) for position in positions]
    straight = {position.axis for position in every if not position.is_tilted}
    return [position for position in every if position.is_tilted] if straight >= set(BODY_AXES) else []


def _tilt_of(position: Position) -> str:
    """Return the name of what the axis of rotation of a tilted mounting leans by, towards the axis of an output."""
    return f"{position} tilt"


def _names(position: Position) -> tuple[str, ...]:
    return tuple(f"{position.end} {part} {wave}" for part in PARTS for wave in WAVES)


def _shown(position: Position, names: Iterable[str]) -> list[float]:
    """Return what a mounting shows of angles, by their names."""
    regressors = {}
    for part, turned_deg in zip(PARTS, (position.unit_deg, position.turned_deg), strict=True):
        angle_rad = np.deg2rad(turned_deg)
        for wave, value in zip(WAVES, (np.cos(angle_rad), np.sin(angle_rad)), strict=True):
            regressors[f"{position.end} {part} {wave}"] = float(value)
    return [regressors.get(name, 0.0) for name in names]


def _separated(sign: Array, angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the combinations of angles that mountings separate from the misalignment, (l, k) orthonormal.

    Where some angles together look like a misalignment (a null vector of the design with a part in it), the smallest
    such combination is left in the misalignment; of the others those are returned that show.
    """
    null = _null_space(np.column_stack([sign, angles]))
    alike = null @ null[0]  # the part of the misalignment's own direction that no mounting sees
    free = np.eye(angles.shape[1])
    if np.linalg.norm(alike) > UNSEEN:
        free = _null_space(alike[None, 1:])
    _, sizes, rows = np.linalg.svd(angles @ free)
    is_seen = sizes > UNSEEN * max(float(sizes.max(initial=0.0)), 1.0)
    return np.asarray(free @ rows[: len(is_seen)][is_seen].T)


def _null_space(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return an orthonormal basis (c, k) of what a matrix (r, c) maps to nothing."""
    _, sizes, rows = np.linalg.svd(matrix)
    rank = int(np.sum(sizes > UNSEEN * max(float(sizes.max(initial=0.0)), 1.0)))
    return np.asarray(rows[rank:].T)
