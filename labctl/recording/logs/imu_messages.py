"""Which messages sensor_msgs/Imu of a bag are damaged: bags have no checksum of a message, but most of one is known."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from labctl.recording.unread import Unread

#: Sizes that no number of such a message has, but random bits do.
SMALLEST, LARGEST = 1e-30, 1e12
#: A time stamp that departs from those of its neighbours by more than this, against their arrival, is damaged, s.
MOST_APART_S = 1.0
#: Messages that a message is compared with: itself and two on either side.
NEIGHBOURS = 5
NS = 1_000_000_000


class Vector(Protocol):
    """A geometry_msgs/Vector3."""

    x: float
    y: float
    z: float


class Head(Protocol):
    """A std_msgs/Header."""

    frame_id: str


class ImuMessage(Protocol):
    """A sensor_msgs/Imu, as rosbags gives it."""

    header: Head
    orientation_covariance: NDArray[np.float64]
    angular_velocity: Vector
    angular_velocity_covariance: NDArray[np.float64]
    linear_acceleration: Vector
    linear_acceleration_covariance: NDArray[np.float64]


def is_damaged(message: ImuMessage) -> bool:
    """Return whether the numbers or the name of the frame of a message are none that a driver writes."""
    numbers = np.concatenate([
        message.orientation_covariance, message.angular_velocity_covariance, message.linear_acceleration_covariance,
        [getattr(each, axis) for each in (message.angular_velocity, message.linear_acceleration) for axis in "xyz"],
    ])  # fmt: skip
    size = np.abs(numbers)
    odd = np.isinf(size) | (size > LARGEST) | ((size > 0) & (size < SMALLEST))
    return bool(odd.any()) or not message.header.frame_id.isprintable()


def with_damaged_times(
    damaged: NDArray[np.bool_], at_ns: NDArray[np.int64], arrived_ns: NDArray[np.int64], values: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return which messages are damaged, (n,): also those whose time is none, or whose values, (n, 6), are all 0."""
    found = damaged | ((at_ns == 0) & (np.median(at_ns) != 0))
    empty = ~values.any(axis=1)
    if np.mean(empty) < 0.5:  # else the unit has no other output
        found |= empty
    if len(at_ns) >= NEIGHBOURS:
        late_s = (at_ns - arrived_ns) / NS
        padded = np.pad(late_s, NEIGHBOURS // 2, mode="edge")
        usual = np.median(np.lib.stride_tricks.sliding_window_view(padded, NEIGHBOURS), axis=1)
        found |= np.abs(late_s - usual) > MOST_APART_S
    return found


def unread_messages(damaged: NDArray[np.bool_], arrived_ns: NDArray[np.int64], stated: int) -> Unread | None:
    """Return what of the `stated` messages of a topic was not found or is damaged; None where nothing is."""
    lost = max(stated - len(damaged), 0)
    if not lost and not damaged.any():
        return None
    t_s = (arrived_ns - arrived_ns[0]) / NS if len(arrived_ns) else np.zeros(0)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], damaged, [False]]).astype(np.int8)))
    places = [
        f"messages {first + 1} to {end} ({t_s[first]:.3f} s to {t_s[end - 1]:.3f} s)"
        for first, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    ]
    if lost:
        place = f"{lost} of the {stated} messages that its index states are not there"
        if len(t_s) > 1:
            gap = int(np.argmax(np.diff(t_s)))
            place += f"; the longest gap is from {t_s[gap]:.3f} s to {t_s[gap + 1]:.3f} s"
            place += f", the last message at {t_s[-1]:.3f} s"
        places.append(place)
    return Unread((lost + int(damaged.sum())) / max(stated, len(damaged), 1), tuple(places))
