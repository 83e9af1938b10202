"""People who walk: the pedestrian model, their walks, and those who react to quadcopters."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_nav.sim.motion import Walkers
from quad_nav.sim.movers import Movers
from quad_nav.sim.scene import Scene, Walls
from quad_nav.sim.scene_file import load_scene
from quad_nav.sim.simulation import Simulation
from quad_nav.sim.simulation_params import STEPS_PER_S
from quad_nav.sim.social_force import repulsion
from quad_nav.sim.walkers import MODEL, Crowd

ROOT = Path(__file__).resolve().parents[3]


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


def test_a_scene_without_room_for_people():
    full = Scene("closet", 1.0, 1.0, 1.0, Walls(), (), (Pose2D(0.5, 0.5),), walkers=Walkers(1))
    with pytest.raises(InputError, match="there is no free place for a person"):
        Movers(full)
    busy = replace(full, size_x_m=4.0, size_y_m=4.0, starts=(Pose2D(1.0, 1.0),))
    with pytest.raises(InputError, match="no room for person"):
        Movers(replace(busy, walkers=Walkers(50)))


def hovering(scene, seed, *advances):
    simulation = Simulation(scene, 2, seed=seed)
    for steps in advances:
        simulation.advance(steps)
    result = simulation.contacts, simulation.body_state.obstacles.tolist()
    simulation.close()
    return result


@pytest.mark.slow
def test_people_who_react_walk_round_quadcopters(crowded):
    """Of those who do not, some walk into one of the two that hover."""
    reacting = replace(crowded, walkers=Walkers(10, reacting=True))
    touched, _ = hovering(crowded, 0, 60 * STEPS_PER_S)
    assert {contact.other[:7] for contact in touched} == {"person_"}
    assert hovering(reacting, 0, 60 * STEPS_PER_S)[0] == []


def test_people_who_react_do_so_whatever_the_calls(crowded):
    reacting = replace(crowded, walkers=Walkers(10, reacting=True))
    one = hovering(reacting, 0, 200)
    assert hovering(reacting, 0, 1, 2, 3, 4, 190) == hovering(reacting, 0, *(200 * [1])) == one
    assert hovering(reacting, 1, 200) != one


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
