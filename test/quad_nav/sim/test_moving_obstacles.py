"""Moving obstacles: seen by LIDARs, touched by quadcopters, in markers and recordings."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Polygon
from moving_cart import cart, scene_with

from quad_nav.offline.run import fly
from quad_nav.recording.bag_file import read_messages
from quad_nav.recording.bag_trace import read_trace
from quad_nav.recording.recorder import Recorder
from quad_nav.report.animation import animate_flight
from quad_nav.report.matplotlib_figures import paths_picture
from quad_nav.report.measures import clearances_m, resampled_tracks
from quad_nav.report.paths import flown_paths
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.motion import Motion
from quad_nav.sim.movers import Movers
from quad_nav.sim.obstacles import Box, Cylinder, Sphere
from quad_nav.sim.scene import MovingObstacle
from quad_nav.sim.simulation import Simulation
from quad_nav.sim.simulation_params import STEPS_PER_S, SimulationParams
from quad_nav.topics.markers import CYLINDER, moving_markers
from quad_nav.topics.obstacle_poses import POSES_TOPIC

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.parametrize("caster", ["kernel", "bullet"])
def test_scans_see_an_obstacle_where_it_is_at_their_time(caster):
    """Beams to the left, back, right and ahead of (6, 5): the cart comes from the west."""
    params = SimulationParams(
        LidarParams(2 * math.pi, math.pi / 2, noise_std_m=0.0), lidar_caster=caster
    )
    simulation = Simulation(scene_with(cart()), 1, params)
    for time_s in (0.0, 1.0, 2.5):
        simulation.advance(round(time_s * STEPS_PER_S) - simulation.step_count)
        west = simulation.scan(0).ranges_m[0]
        assert west == pytest.approx(6.0 - (2.0 + time_s) - 0.5, abs=2e-3)
    simulation.close()


@pytest.mark.parametrize(
    "shape, time_s",
    [
        (Cylinder("cart", 2.0, 5.0, 0.5, 2.0), 4.0 - 0.8),
        (Box("cart", 2.0, 5.0, 1.2, 0.6, 2.0), 4.0 - 0.9),
        (Sphere("cart", 2.0, 5.0, 1.06, 0.4), 4.0 - 0.7),
    ],
)
def test_a_hovering_quadcopter_is_hit_when_the_obstacle_arrives(shape, time_s):
    simulation = Simulation(scene_with(cart(shape)), 1)
    contacts = simulation.advance(4 * STEPS_PER_S)
    assert [str(contact) for contact in contacts] == ["quad0 touches cart"]
    assert contacts[0].time_s == pytest.approx(time_s, abs=0.02)
    assert simulation.state(0).map_from_base.x_m > 6.3  # pushed away
    simulation.close()


def test_what_passes_above_below_or_beside_does_not_touch():
    shapes = (
        Cylinder("low", 2.0, 5.0, 0.5, 0.8),
        Cylinder("high", 2.0, 5.0, 0.5, 1.0, bottom_m=1.3),
    )
    beside = Motion((0.0, 8.0), ((2.0, 5.9, 0.0), (10.0, 5.9, 0.0)))
    moving = [*(cart(shape) for shape in shapes)]
    moving.append(MovingObstacle(Cylinder("near", 2.0, 5.9, 0.5, 2.0), beside))
    simulation = Simulation(scene_with(*moving), 1)
    assert simulation.advance(8 * STEPS_PER_S) == []
    simulation.close()


def test_the_engine_and_free_flight_give_the_same_contact():
    """A jump of the loop, too, into the quadcopter: nothing is between the two places."""
    jump = Motion((0.0, 1.0), ((6.4, 5.0, 0.0), (9.0, 5.0, 0.0)), phase_s=0.5)
    scene = scene_with(MovingObstacle(Cylinder("ghost", 0.0, 0.0, 0.5, 2.0), jump))
    kernel, bullet = (
        Simulation(scene, 1, SimulationParams(lidar_caster=caster))
        for caster in ("kernel", "bullet")
    )
    first, second = kernel.advance(STEPS_PER_S), bullet.advance(STEPS_PER_S)
    assert first == second and len(first) == 1
    assert first[0].time_s == pytest.approx(0.5, abs=1.5 / STEPS_PER_S)
    kernel.close()
    bullet.close()


def test_distances_are_to_where_obstacles_are():
    """At (6, 5) the cart is 4 - t away, less its radius; the walls are 5 m away."""
    movers = Movers(scene_with(cart()), start_s=10.0)
    times_s = np.array([10.0, 12.0, 14.0])
    distances = movers.flight_surface_distances_m(np.full((3, 2), (6.0, 5.0)), times_s)
    assert distances == pytest.approx([3.5, 1.5, -0.5])
    box = Movers(scene_with(cart(Box("cart", 0.0, 0.0, 1.0, 2.0, 2.0))))
    assert box.distances_m(np.array([[2.0, 7.0], [4.0, 7.0]]), np.array([0.0, 0.0])) == (
        pytest.approx([1.0, math.hypot(1.5, 1.0)])
    )


def test_a_reset_with_the_clock_starts_motions_again():
    simulation = Simulation(scene_with(cart(phase_s=None)), 1, seed=3)
    start = simulation.body_state.obstacles.tolist()
    simulation.advance(100)
    simulation.reset()
    assert simulation.body_state.obstacles.tolist() != start
    simulation.reset(start_step=50)
    assert simulation.body_state.obstacles.tolist() == start
    simulation.reset(seed=4, start_step=50)
    assert simulation.body_state.obstacles.tolist() != start
    simulation.close()


def test_markers_are_where_the_obstacles_are():
    (marker,) = moving_markers(Movers(scene_with(cart())), 3.0)
    assert (marker.kind, marker.frame, marker.namespace) == (CYLINDER, "map", "moving")
    assert marker.place_m == (5.0, 5.0, 1.0) and marker.size_m == (1.0, 1.0, 2.0)


def test_recordings_have_the_obstacles_and_reports_show_them(tmp_path):
    """The cart comes within the flight's two seconds; the quadcopter's goal is its start."""
    setup = read_setup(
        FlightOptions(
            ROOT / "scenes" / "arena.yaml", ROOT / "goals", robots=1, time_limit_s=2.0, seed=5
        )
    )
    scene = replace(setup.scene, moving=(cart(phase_s=None),), motion_phase_s=1.0)
    setup = replace(setup, scene=scene)
    path = tmp_path / "flight.bag"
    summary = fly(setup, [Recorder(path)])
    trace = read_trace(path)
    assert trace.scene == scene and trace.seed == 5
    clearance_m = np.nanmin(clearances_m(resampled_tracks(trace), trace))
    assert clearance_m == pytest.approx(summary.robots[0].min_clearance_m, abs=1e-6)
    sent = list(read_messages(path, lambda topic, kind: topic == POSES_TOPIC))
    assert len(sent) == 21
    movers = Movers(scene, 5)
    for k in (0, 7, 20):
        x_m, y_m, _ = movers.poses(0.1 * k)[0]
        position = sent[k].content.poses[0].position
        assert (position.x, position.y) == pytest.approx((x_m, y_m))
    figure = paths_picture(flown_paths(trace, resampled_tracks(trace), []))
    drawn = [patch for patch in figure.axes[0].patches if isinstance(patch, Polygon)]
    middles = [patch.get_xy()[:-1].mean(axis=0) for patch in drawn]
    assert any(at == pytest.approx(movers.poses(2.0)[0, :2]) for at in middles)
    animate_flight(trace, tmp_path / "flight.gif")
    assert (tmp_path / "flight.gif").stat().st_size > 1000
