"""The figures of a live calibration as answers: the same at the terminal, over HTTP and on the page."""

from __future__ import annotations

from dataclasses import asdict
from typing import TypedDict

from labctl.answers.live import LiveCoefficientResponse, LiveMoment, LivePoseResponse, LiveTargetResponse
from labctl.fitting.live import LiveState, Target
from labctl.fitting.live.directions import DIRECTIONS, Direction
from labctl.fitting.live.state import LiveCoefficient


class _Figures(TypedDict):
    """The fields of `LiveFigures`."""

    readings: int
    lost: int
    damaged: int
    duration_s: float
    rests: int
    poses: list[str]
    poses_asked: int
    coefficients: list[LiveCoefficientResponse]
    missing: list[str]
    left_out: list[str]


def figures_of(state: LiveState) -> _Figures:
    """Return what is determined, as the fields that the answer at the end and those on the way share."""
    return {
        "readings": state.readings,
        "lost": state.lost,
        "damaged": state.damaged,
        "duration_s": state.t_s,
        "rests": state.rests,
        "poses": list(state.covered),
        "poses_asked": state.wanted,
        "coefficients": [coefficient_of(coefficient) for coefficient in state.coefficients],
        "missing": list(state.missing),
        "left_out": list(state.left_out),
    }


def coefficient_of(coefficient: LiveCoefficient) -> LiveCoefficientResponse:
    """Return a coefficient as an answer."""
    return LiveCoefficientResponse(**asdict(coefficient))


def moment_of(state: LiveState, fits: int, example: str) -> LiveMoment:
    """Return how a live calibration stands; `example`: what is wrong with the first line that is no reading."""
    request = state.request
    return LiveMoment(
        **figures_of(state),
        still_s=state.still_s,
        up=None if state.up is None else list(state.up),
        request=None if request is None else _pose(request.pose, state),
        off_deg=state.off_deg,
        request_text="" if request is None else request.text,
        pose_list=[_pose(each, state) for each in DIRECTIONS[: state.wanted]],
        turns_left=state.turns_left,
        fits=fits,
        example=example,
    )


def target_of(target: Target) -> LiveTargetResponse:
    """Return a target as an answer."""
    return LiveTargetResponse(**asdict(target))


def _pose(pose: Direction, state: LiveState) -> LivePoseResponse:
    return LivePoseResponse(name=pose.name, text=pose.text, up=list(pose.up), covered=pose.name in state.covered)
