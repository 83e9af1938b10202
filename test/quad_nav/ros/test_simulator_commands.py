"""How long the simulator waits for the next command of a node before a quadcopter hovers."""

from __future__ import annotations

import pytest

rospy = pytest.importorskip("rospy")

from geometry_msgs.msg import Twist, Vector3  # noqa: E402
from ros.fake_ros import FakeRos, deliver  # noqa: E402

from quad_nav.geometry import Pose2D  # noqa: E402
from quad_nav.ros.simulator.commands import Commands  # noqa: E402
from quad_nav.sim.scene import Scene, Walls  # noqa: E402
from quad_nav.sim.simulation import Simulation  # noqa: E402
from quad_nav.sim.simulation_params import STEPS_PER_S  # noqa: E402

ROOM = Scene("room", 20.0, 20.0, 1.0, Walls(), (), (Pose2D(2.0, 2.0),))


@pytest.mark.parametrize(
    ("frequency_hz", "valid_s"),
    [(1.0, 1.5), (2, 1.0), (20.0, 0.55), (40.0, 0.55), (None, 0.55), (0.0, 0.55), ("1 Hz", 0.55)],
)
def test_a_command_is_valid_for_the_period_of_its_navigator_and_half_a_second(
    frequency_hz, valid_s
):
    with FakeRos("/simulator") as ros:
        simulation = Simulation(ROOM, 1)
        commands = Commands(simulation)
        rospy.set_param("/robot0/planner/controller_frequency", frequency_hz)
        deliver("/cmd_vel0", Twist(linear=Vector3(0.3, 0.0, 0.0)), "/robot0/planner")
        commands.take()
        simulation.advance(round(valid_s * STEPS_PER_S))
        assert not simulation.is_hovering[0]
        simulation.advance(2)
        assert simulation.is_hovering[0]
        assert ros.log.lines == []
        simulation.close()
