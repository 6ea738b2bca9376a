"""Which pose is asked for next."""

from __future__ import annotations

import numpy as np

from labctl.fitting.live.calibration import needs_of_turns, next_pose
from labctl.fitting.live.directions import DIRECTIONS, NEAR_DEG, covered, turn_between


def test_faces_edges_and_corners_in_this_order() -> None:
    assert [len(each.name.split(",")) for each in DIRECTIONS] == [1] * 6 + [2] * 12 + [3] * 8
    ups = np.array([each.up for each in DIRECTIONS])
    assert np.allclose(np.linalg.norm(ups, axis=1), 1)
    apart = np.degrees(np.arccos(np.clip(ups @ ups.T, -1, 1)))[~np.eye(26, dtype=bool)]
    assert apart.min() > 2 * NEAR_DEG  # one rest covers one pose


def test_a_pose_in_words() -> None:
    texts = {each.name: each.text for each in DIRECTIONS}
    assert texts["-y"] == "body axis -y pointing up"
    assert texts["x,-z"] == "body axes x and -z pointing up equally, on an edge"
    assert texts["x,y,-z"] == "body axes x, y and -z pointing up equally, on a corner"


def test_the_turn_is_about_the_axis_of_which_least_is_known() -> None:
    up = np.array([[0.0, 0, 1]])
    done = covered(up)
    assert sum(done) == 1
    about_x = next_pose(done, 18, up[0], np.array([1.0, 0.1, 0.1]))
    axis, angle_deg = turn_between(up[0], np.array(about_x.up))
    assert abs(axis[0]) == 1
    assert angle_deg >= 60
    about_y = next_pose(done, 18, up[0], np.array([0.1, 1.0, 0.1]))
    assert abs(turn_between(up[0], np.array(about_y.up))[0][1]) == 1


def test_an_axis_about_which_the_unit_did_not_turn_is_needed_most() -> None:
    up = np.array([[0.0, 0, 1], [0, 1, 0], [0, 0, -1]])
    needs = needs_of_turns(up)
    assert needs[0] < needs[1] == needs[2]


def test_only_missing_poses_are_asked_for_until_none_is() -> None:
    here = np.array([0.0, 0, 1])
    all_but_one = tuple(each.name != "-x" for each in DIRECTIONS)
    assert next_pose(all_but_one, 18, here, np.ones(3)).name == "-x"
    done = (True,) * 26
    assert next_pose(done, 18, here, np.array([1.0, 0, 0])).name.strip("-") in {"y", "y,-z", "y,z", "-y,-z"}
    assert next_pose((False,) * 26, 18, None, np.ones(3)).name == "z"
