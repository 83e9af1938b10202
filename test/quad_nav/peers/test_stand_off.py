"""Stand-offs with moving obstacles in a corridor of 1.2 m along x, between y = 4.4 m and y = 5.6 m.

The robots' safety radius is 0.35 m and the margin 0, so that centres keep 0.8 m and holding points
1.0 m. Cells are 0.1 m.
"""

from __future__ import annotations

import numpy as np
import pytest

from quad_nav.config import load
from quad_nav.costmap.tracks import Tracks
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import LETHAL
from quad_nav.peers.peer import Peer
from quad_nav.peers.right_of_way import MOVING_OBSTACLE, Yield
from quad_nav.peers.stand_off import StandOff
from quad_nav.scenario.assembly import build_navigator

TREE = {
    "global_costmap": {"width": 10.0, "height": 10.0, "robot_radius": 0.35, "resolution": 0.1},
    "local_costmap": {"width": 3.0, "height": 3.0, "robot_radius": 0.35, "rolling_window": True},
}
GOAL_PATH = np.array([[4.0, 5.0], [9.0, 5.0]])
PATIENCE_S = 3.0


@pytest.fixture
def coordinator():
    """The coordinator of a robot that came along y = 5 m into a corridor from x = 3 m on."""
    navigator = build_navigator(load({**TREE, "robot": 0}))
    costs = navigator.global_costmap.costs
    costs[:44, 30:] = LETHAL
    costs[56:, 30:] = LETHAL
    return navigator.peers


@pytest.fixture
def stand_off(coordinator) -> StandOff:
    return coordinator._stand_off


def come(stand_off: StandOff, obstacle=(5.5, 5.0)) -> Pose2D:
    """Fly from (1, 5) to (4, 5) in 30 s, and see a moving obstacle."""
    for k in range(31):
        pose = Pose2D(1.0 + 0.1 * k, 5.0)
        stand_off.observe(float(k), pose, np.array([obstacle]))
        assert stand_off.decide(float(k), pose, GOAL_PATH, None, PATIENCE_S) is None
    return pose


def wait(stand_off: StandOff, pose: Pose2D, obstacles: np.ndarray, seconds: int = 20):
    """Stand; return the decision, and the seconds until it."""
    for k in range(1, seconds + 1):
        stand_off.observe(30.0 + k, pose, obstacles)
        decision = stand_off.decide(30.0 + k, pose, GOAL_PATH, None, PATIENCE_S)
        if decision is not None:
            return decision, k
    return None, seconds


NOBODY = np.zeros((0, 2))


def test_a_blocked_robot_backs_out_of_the_corridor_within_nine_seconds(stand_off) -> None:
    decision, seconds = wait(stand_off, come(stand_off), NOBODY)
    assert decision.peer == MOVING_OBSTACLE and decision.action is Yield.MAKE_ROOM
    # A patience of 3 to 9 s, checked once per second.
    assert seconds <= 10
    point = decision.holding_point
    assert point.x_m < 3.0
    assert abs(point.y_m - 5.0) >= 1.0 - 0.1
    assert str(decision).startswith("making room for a moving obstacle at (")


def test_a_robot_without_a_obstacle_ahead_stays(stand_off) -> None:
    assert wait(stand_off, come(stand_off, obstacle=(2.0, 6.0)), NOBODY)[0] is None
    far = np.array([[7.5, 5.0]])  # 3.5 m away
    stand_off.restart()
    assert wait(stand_off, Pose2D(4.0, 5.0), far)[0] is None


def test_it_goes_on_when_the_obstacle_has_passed(stand_off) -> None:
    decision, seconds = wait(stand_off, come(stand_off), NOBODY)
    point, now_s = decision.holding_point, 30.0 + seconds

    def keeps(x_m: float) -> bool:
        stand_off.observe(now_s, point, np.array([[x_m, 5.0]]))
        return stand_off.decide(now_s, point, GOAL_PATH, decision, PATIENCE_S) is not None

    assert keeps(4.5)
    assert keeps(3.5)
    assert keeps(point.x_m)
    assert keeps(point.x_m - 0.6)
    assert not keeps(point.x_m - 1.0)  # by more than the separation of 0.8 m


def test_a_peer_that_went_silent_keeps_its_cell_for_a_second_where_obstacles_are_tracked(
    coordinator,
) -> None:
    """It was 2 m ahead at 0 s, and came nearer at 0.5 m/s; ``peer_timeout`` is 0.5 s."""
    here, word = Pose2D(2.0, 5.0), Peer("quad1", 4.0, 5.0, -0.5, 0.0, 0.0)

    def limited(now_s: float, tracks) -> str:
        coordinator.observe(now_s, here, Pose2D(0.0, 0.0), [word], 0.3, tracks)
        return coordinator.cell(here, Twist2D(), 0.1).limit(Twist2D(vx_mps=2.0))[1]

    assert limited(0.4, Tracks.none(0.4)) == "quad1"
    assert limited(1.4, Tracks.none(1.4)) == "quad1"
    assert [peer.x_m for peer in coordinator._tracker.silent] == [pytest.approx(4.0 - 0.5 * 1.4)]
    assert not coordinator.peers
    assert limited(1.4, None) == ""
    assert limited(1.6, Tracks.none(1.6)) == ""
    coordinator.observe(1.7, here, Pose2D(0.0, 0.0), [], 0.3, None)
    assert coordinator._tracker.silent == []
