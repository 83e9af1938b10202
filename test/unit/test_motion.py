"""Moving obstacles: poses as a function of time, seen by LIDARs and touched by quadcopters."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Circle

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_nav.kernels.social_force import repulsion
from quad_nav.offline.run import fly
from quad_nav.recording.bag_file import read_messages
from quad_nav.recording.bag_trace import read_trace
from quad_nav.recording.recorder import Recorder
from quad_nav.report.animation import animate_flight
from quad_nav.report.measures import clearances_m, resampled_tracks
from quad_nav.report.paths_picture import paths_picture
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.motion import LINEAR, SPLINE, Motion, Walkers
from quad_nav.sim.movers import Motions, Movers, phases_s
from quad_nav.sim.scene import Box, Cylinder, MovingObstacle, Scene, Sphere, Walls
from quad_nav.sim.scene_file import load_scene, scene_from_document
from quad_nav.sim.scene_writer import scene_document, write_scene
from quad_nav.sim.simulation import STEPS_PER_S, Simulation, SimulationParams
from quad_nav.sim.walkers import MODEL, Crowd
from quad_nav.topics.markers import CYLINDER, OBSTACLES_TOPIC, moving_markers

ROOT = Path(__file__).resolve().parents[2]

POINTS = ((0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (4.0, 2.0, 1.0))


def motion(points=POINTS, times_s=(0.0, 2.0, 3.0), **given):
    return Motion(times_s, points, **given)


def poses(one, *times_s, phase_s=0.0):
    return Motions([one], [phase_s]).poses(np.array(times_s))[:, 0].tolist()


START = Pose2D(6.0, 5.0)


def scene_with(*moving, **given):
    return Scene("yard", 12.0, 12.0, 1.0, Walls(), (), (START,), moving=moving, **given)


def cart(shape=None, speed_mps=1.0, **given):
    """From (2, 5) along x to (10, 5)."""
    shape = shape or Cylinder("cart", 2.0, 5.0, 0.5, 2.0)
    return MovingObstacle(
        shape, Motion((0.0, 8.0 / speed_mps), ((2.0, 5.0, 0.0), (10.0, 5.0, 0.0)), **given)
    )


def test_straight_lines_at_constant_speed():
    assert poses(motion(loop=False), 0.0, 0.5, 2.0, 2.5, 3.0, 9.0) == [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [4.0, 0.0, 0.0],
        [4.0, 1.0, 0.5],
        [4.0, 2.0, 1.0],
        [4.0, 2.0, 1.0],
    ]


def test_a_loop_jumps_from_its_last_keyframe_to_its_first():
    before, at, after = poses(motion(), 3.0 - 1e-9, 3.0, 3.5)
    assert before == pytest.approx([4.0, 2.0, 1.0], abs=1e-6)
    assert at == [0.0, 0.0, 0.0]
    assert after == [1.0, 0.0, 0.0]
    assert poses(motion(), 0.5, phase_s=3.0) == [after]
    assert poses(motion(), 0.0, phase_s=-2.5) == [after]


def test_a_body_waits_for_its_first_keyframe_in_every_loop():
    late = motion(times_s=(1.0, 2.0, 3.0))
    assert [x for x, _, _ in poses(late, 0.0, 1.0, 1.5, 3.5, 4.5)] == [0.0, 0.0, 2.0, 0.0, 2.0]


def test_the_spline_in_the_middle_of_each_segment():
    """At u = 0.5: (P[i] + P[i+1]) / 2 + (M[i] - M[i+1]) / 8, whatever the times are.

    M = (2, 0), (2, 1), (0, 1) and for the yaw 0, 0.5, 0.5.
    """
    first, second = poses(motion(interpolation=SPLINE), 1.0, 2.5)
    assert first == pytest.approx([2.0, -1.0 / 8.0, -0.5 / 8.0])
    assert second == pytest.approx([4.0 + 2.0 / 8.0, 1.0, 0.5])


def test_the_spline_at_a_quarter():
    """u = 1/4: 54/64 P[0] + 9/64 M[0] + 10/64 P[1] - 3/64 M[1]."""
    ((x, y, _),) = poses(motion(interpolation=SPLINE), 0.5)
    assert x == pytest.approx((9.0 * 2.0 + 10.0 * 4.0 - 3.0 * 2.0) / 64.0)
    assert y == pytest.approx(-3.0 * 1.0 / 64.0)


def test_a_closed_spline_has_equal_tangents_at_its_ends():
    square = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.0))
    closed = motion(square, (0.0, 1.0, 2.0, 3.0, 4.0), interpolation=SPLINE)
    tangents = closed.tangents()[:, :2].tolist()
    assert tangents[0] == tangents[-1] == [0.5, -0.5]
    assert tangents[1] == [0.5, 0.5]
    assert not motion(square, (0.0, 1.0, 2.0, 3.0, 4.0), tension=1.0).tangents().any()


def test_random_phases_follow_from_the_seed():
    motions = [motion(phase_s=None), motion(phase_s=None), motion(phase_s=1.5)]
    once, again, other = (phases_s(motions, 0.0, seed) for seed in (1, 1, 2))
    assert once == again != other
    assert once[0] != once[1] and once[2] == 1.5
    assert all(0.0 <= phase_s < 3.0 for phase_s in once[:2])


def test_a_common_random_phase_is_a_part_of_the_longest_loop():
    motions = [motion(), motion(times_s=(0.0, 20.0, 30.0))]
    drawn = [phases_s(motions, None, seed) for seed in range(200)]
    assert all(first == second for first, second in drawn)
    firsts = np.array(drawn)[:, 0]
    assert 0.0 <= firsts.min() < 3.0 and 27.0 < firsts.max() < 30.0


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


def test_both_casters_agree_on_moving_boxes_cylinders_and_spheres():
    points = ((2.0, 2.0, 0.0), (9.0, 2.0, 2.0), (3.0, 9.0, 4.0))
    along = Motion((0.0, 4.0, 9.0), points, interpolation=SPLINE)
    moving = [
        MovingObstacle(shape, along)
        for shape in (
            Box("box", 0.0, 0.0, 1.5, 0.4, 2.0),
            Cylinder("column", 0.0, 0.0, 0.3, 2.0),
            Sphere("ball", 0.0, 0.0, 1.0, 0.4),
        )
    ]
    for one in moving:
        params = [SimulationParams(lidar_caster=caster) for caster in ("kernel", "bullet")]
        kernel, bullet = (Simulation(scene_with(one), 1, param) for param in params)
        for _ in range(6):
            kernel.advance(STEPS_PER_S)
            bullet.advance(STEPS_PER_S)
            off_m = np.abs(kernel.scan(0).ranges_m - bullet.scan(0).ranges_m)
            assert np.quantile(off_m, 0.98) < 2e-3
            assert kernel.scan(0).ranges_m.min() < 5.0  # it is in sight
        kernel.close()
        bullet.close()


@pytest.mark.parametrize("caster", ["kernel", "bullet"])
@pytest.mark.parametrize(
    "shape, time_s",
    [
        (Cylinder("cart", 2.0, 5.0, 0.5, 2.0), 4.0 - 0.8),
        (Box("cart", 2.0, 5.0, 1.2, 0.6, 2.0), 4.0 - 0.9),
        (Sphere("cart", 2.0, 5.0, 1.06, 0.4), 4.0 - 0.7),
    ],
)
def test_a_hovering_quadcopter_is_hit_when_the_obstacle_arrives(caster, shape, time_s):
    simulation = Simulation(scene_with(cart(shape)), 1, SimulationParams(lidar_caster=caster))
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


def document(**given):
    return {"size": [12.0, 12.0], "starts": [[6.0, 5.0]], **given}


def moving_document(**given):
    keyframes = [{"time": 0, "x": 2.0, "y": 5.0}, {"time": 8.0, "x": 10.0, "y": 5.0, "yaw": 1.0}]
    shape = {"name": "cart", "shape": "box", "size": [1.0, 0.5], "height": 2.0, "yaw": 0.5}
    return document(obstacles=[{**shape, "motion": {"keyframes": keyframes, **given}}])


def test_a_motion_in_a_file():
    scene = scene_from_document(moving_document(phase="random"), "s.yaml")
    assert scene.obstacles == ()
    (one,) = scene.moving
    assert one.shape == Box("cart", 2.0, 5.0, 1.0, 0.5, 2.0, 0.5)
    assert one.motion == Motion(
        (0.0, 8.0), ((2.0, 5.0, 0.5), (10.0, 5.0, 1.0)), True, LINEAR, 0.0, None
    )


def test_scenes_with_motions_are_written_and_read_again(tmp_path):
    shapes = (
        Box("box", 2.0, 5.0, 1.0, 0.5, 2.0),
        Cylinder("post", 2.0, 5.0, 0.2, 2.0, 0.1),
        Sphere("ball", 2.0, 5.0, 1.0, 0.3),
    )
    scene = scene_with(
        cart(shapes[0], interpolation=SPLINE, tension=0.5),
        cart(shapes[1], loop=False, phase_s=2.0),
        cart(shapes[2], phase_s=None),
        motion_phase_s=None,
        walkers=Walkers(3, (0.6, 1.0), 0.2, reacting=True),
    )
    write_scene(scene, tmp_path / "yard.yaml")
    assert load_scene(tmp_path / "yard.yaml") == scene
    assert scene_from_document(scene_document(scene), "s") == scene


@pytest.mark.parametrize(
    "given, problem",
    [
        (moving_document(keyframes=[]), "keyframes: a list of 0, expected a list of 1 to 10000"),
        (
            moving_document(keyframes=[{"time": 1, "x": 0, "y": 0}, {"time": 1, "x": 1, "y": 0}]),
            "keyframes[1].time: 1, expected more than that of the keyframe before, 1",
        ),
        (
            moving_document(keyframes=[{"time": -1, "x": 0, "y": 0}]),
            "keyframes[0].time: -1, expected 0 or more",
        ),
        (
            moving_document(keyframes=[{"time": 0, "x": 0, "z": 0, "y": 0}]),
            "keyframes[0].z: unknown key; known: time, x, y, yaw",
        ),
        (
            moving_document(interpolation="cubic"),
            "interpolation: 'cubic', expected linear or spline",
        ),
        (
            moving_document(tension=0.5),
            "tension: given without interpolation: spline, expected both",
        ),
        (moving_document(loop=1), "loop: 1, expected true or false"),
        (moving_document(phase="any"), "phase: 'any', expected random, or seconds"),
        (
            moving_document(phase="random", loop=False),
            "phase: random without a loop, expected loop: true, or seconds",
        ),
    ],
)
def test_faults_of_motions(given, problem):
    with pytest.raises(InputError) as error:
        scene_from_document(given, "s.yaml")
    assert error.value.problems == [f"s.yaml: obstacles[0].motion.{problem}"]


@pytest.mark.parametrize(
    "walkers, problem",
    [
        ({"count": 0}, "walkers.count: 0, expected a number of 1 to 200"),
        ({"count": 2, "reacting": "no"}, "walkers.reacting: 'no', expected true or false"),
        (
            {"count": 2, "speed": [2.0, 1.0]},
            "walkers.speed: 2, 1, expected the lowest and the highest speed, at most 5 m/s",
        ),
    ],
)
def test_faults_of_walkers(walkers, problem):
    with pytest.raises(InputError) as error:
        scene_from_document(document(walkers=walkers), "s.yaml")
    assert error.value.problems == [f"s.yaml: {problem}"]


def test_names_of_moving_obstacles_are_unique_too():
    given = moving_document()
    given["obstacles"].append({**given["obstacles"][0]})
    with pytest.raises(InputError, match="name 'cart' is taken, expected unique names"):
        scene_from_document(given, "s.yaml")


def test_the_repulsion_between_two_people():
    """Beside a person who walks by at 1 m/s, at 1 m: half the minor axis follows by Pythagoras."""
    b = 0.5 * math.sqrt((1.0 + math.sqrt(5.0)) ** 2 - 4.0)
    slope = 2.1 / 0.3 * math.exp(-b / 0.3) * (1.0 + math.sqrt(5.0)) / (4.0 * b)
    pushed = repulsion(0.0, 1.0, 1.0, 0.0, MODEL)
    assert pushed == pytest.approx(
        (-slope * 2.0 / math.sqrt(5.0), slope * (1.0 + 1.0 / math.sqrt(5.0)))
    )
    # Behind a person at rest the lines are circles.
    assert repulsion(-0.6, 0.0, 0.0, 0.0, MODEL) == pytest.approx((-7.0 * math.exp(-2.0), 0.0))


@pytest.fixture(scope="module")
def crowded():
    scene = load_scene(ROOT / "scenes" / "arena.yaml")
    return replace(scene, walkers=Walkers(10))


@pytest.mark.slow
def test_people_walk_at_their_speeds_without_touching_anything(crowded):
    times_s = np.arange(0.0, 300.0, 0.2)
    places = Movers(crowded, 3).poses_at(times_s)[..., :2]
    steps_m = np.linalg.norm(np.diff(places, axis=0), axis=2)
    speeds = steps_m.sum(axis=0) / 300.0
    assert steps_m.max() < 1.3 * 1.5 * 0.2 + 1e-9
    assert 0.3 < speeds.min() and speeds.max() < 1.5
    offsets = places[:, :, None] - places[:, None]
    between_m = np.hypot(offsets[..., 0], offsets[..., 1]) + 9.0 * np.eye(10)
    assert between_m.min() > 0.5  # two radii
    low = replace(crowded, altitude_m=0.875)
    assert low.flight_surface_distances_m(places).min() > 0.25
    assert (np.ptp(places, axis=0).max(axis=1) > 3.0).all()  # they get around


def test_walks_follow_from_the_seed_and_go_to_and_fro(crowded):
    walked = [Movers(crowded, seed).poses(20.0).tolist() for seed in (3, 3, 4)]
    assert walked[0] == walked[1] != walked[2]
    movers = Movers(crowded, 3)
    assert movers.poses(300.0 + 7.1) == pytest.approx(movers.poses(300.0 - 7.1))
    assert movers.poses(600.0 + 7.1) == pytest.approx(movers.poses(7.1))
    starts = np.array([[start.x_m, start.y_m] for start in crowded.starts])
    first = movers.poses(0.0)[:, :2]
    assert np.linalg.norm(first[:, None] - starts, axis=2).min() >= 1.5


def test_people_are_seen_and_named(crowded):
    assert [shape.name for shape in Movers(crowded, 3).shapes] == [f"person_{k}" for k in range(10)]
    simulation = Simulation(crowded, 1, seed=3)
    before = simulation.scan(0).ranges_m
    simulation.advance(STEPS_PER_S)
    assert np.abs(simulation.scan(0).ranges_m - before).max() > 0.5
    simulation.close()


def test_a_scene_without_room_for_people():
    full = Scene("closet", 1.0, 1.0, 1.0, Walls(), (), (Pose2D(0.5, 0.5),), walkers=Walkers(1))
    with pytest.raises(InputError, match="there is no free place for a person"):
        Movers(full)
    busy = replace(full, size_x_m=4.0, size_y_m=4.0, starts=(Pose2D(1.0, 1.0),))
    with pytest.raises(InputError, match="no room for person"):
        Movers(replace(busy, walkers=Walkers(50)))


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
    sent = list(read_messages(path, lambda topic, kind: topic == OBSTACLES_TOPIC))
    assert len(sent) == 21
    movers = Movers(scene, 5)
    for k in (0, 7, 20):
        x_m, y_m, _ = movers.poses(0.1 * k)[0]
        position = sent[k].content.markers[0].pose.position
        assert (position.x, position.y) == pytest.approx((x_m, y_m))
    figure = paths_picture(trace, resampled_tracks(trace), [])
    drawn = [patch.center for patch in figure.axes[0].patches if isinstance(patch, Circle)]
    assert any(at == pytest.approx(movers.poses(2.0)[0, :2]) for at in drawn)
    animate_flight(trace, tmp_path / "flight.gif")
    assert (tmp_path / "flight.gif").stat().st_size > 1000


def hovering(scene, seed, *advances):
    simulation = Simulation(scene, 2, seed=seed)
    for steps in advances:
        simulation.advance(steps)
    result = simulation.contacts, simulation.body_state.obstacles.tolist()
    simulation.close()
    return result


@pytest.mark.slow
def test_people_who_react_walk_round_quadcopters(crowded):
    """Of those who do not, some walk into one of the two that hover; seeds 0 and 1."""
    reacting = replace(crowded, walkers=Walkers(10, reacting=True))
    touched = [hovering(crowded, seed, 60 * STEPS_PER_S)[0] for seed in (0, 1)]
    assert all(touched) and {contact.other[:7] for contact in touched[0]} == {"person_"}
    assert [hovering(reacting, seed, 60 * STEPS_PER_S)[0] for seed in (0, 1)] == [[], []]


def test_people_who_react_do_so_whatever_the_calls(crowded):
    reacting = replace(crowded, walkers=Walkers(10, reacting=True))
    one = hovering(reacting, 0, 1000)
    assert hovering(reacting, 0, 1, 2, 3, 4, 990) == hovering(reacting, 0, *(1000 * [1])) == one
    assert hovering(reacting, 1, 1000) != one


def test_people_who_react_keep_to_a_minute_of_memory(crowded):
    crowd = Crowd(replace(crowded, walkers=Walkers(2, reacting=True)), 0)
    no_robots = np.zeros((0, 4))
    for k in range(2500):
        crowd.react(0.025 * k, no_robots, 0.3)
        crowd.react(0.025 * k + 0.01, no_robots, 0.3)  # of the same period
    poses = crowd.poses(np.array([0.0, 40.0, 62.5, 62.6]))
    assert np.isfinite(poses).all(axis=(1, 2)).tolist() == [False, True, True, False]
    between = crowd.poses(np.array([50.0, 50.0125, 50.025]))
    assert between[1] == pytest.approx((between[0] + between[2]) / 2.0)
