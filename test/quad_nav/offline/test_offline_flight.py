"""Offline flights: repeatable, stopped with a reason, refused with every fault."""

from __future__ import annotations

import dataclasses
import json
import multiprocessing
from pathlib import Path

import numpy as np
import pytest

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D, angle_difference
from quad_nav.loop.navigator_group import NavigatorGroup
from quad_nav.loop.worker_process import PROCESS_NAME, WorkerProcessError
from quad_nav.mission.summary import to_json
from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.offline.run import fly
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.motion import Motion, Walkers
from quad_nav.sim.obstacles import Cylinder
from quad_nav.sim.scene import MovingObstacle
from quad_nav.sim.simulation_params import SimulationParams

ROOT = Path(__file__).resolve().parents[3]
FEW_BEAMS = LidarParams(step_size_rad=2 * np.pi / 128, noise_std_m=0.01)


def options(**changes) -> FlightOptions:
    return FlightOptions(
        **{
            "scene": ROOT / "scenes" / "arena.yaml",
            "goals": ROOT / "goals",
            "config": "tutorial",
            "seed": 5,
            "time_limit_s": 4.0,
            "simulation": SimulationParams(FEW_BEAMS, jitter_m=0.3),
            **changes,
        }
    )


def figures(summary) -> dict:
    """Return the summary without values that depend on the machine's speed."""
    slow = ("wall_time_s", "real_time_factor")
    return {key: value for key, value in to_json(summary).items() if key not in slow}


def write_goals(folder: Path, *goals) -> Path:
    (folder / "quad0_goals.json").write_text(json.dumps({"goals": goals}))
    return folder


def worker_processes() -> list:
    return [one for one in multiprocessing.active_children() if one.name == PROCESS_NAME]


class Stop(FlightObserver):
    """Stops the flight after its first period of odometry."""

    stop_reason = ""

    def on_move(self, flight):
        self.stop_reason = "interrupted"


class Track(FlightObserver):
    """Stores the bodies' states at every period of odometry."""

    def __init__(self):
        self.rows = []

    def on_move(self, flight):
        self.rows.append(flight.simulation.body_state.rows)


def test_the_same_seed_gives_the_same_flight_bit_for_bit_and_another_does_not():
    tracks = []
    for seed in (5, 5, 6):
        track = Track()
        fly(read_setup(options(seed=seed)), [track])
        tracks.append(np.array(track.rows))
    assert tracks[0].shape == (160, 2, 13)
    assert np.array_equal(tracks[0], tracks[1])
    assert not np.array_equal(tracks[0], tracks[2])


def test_worker_processes_fly_the_same_flight_bit_for_bit():
    """Four robots meet, so that their intentions matter, and a cart and people do, too."""
    meeting = read_setup(
        options(
            scene=ROOT / "scenes" / "encounters" / "four_ways.yaml",
            goals=ROOT / "goals" / "encounters" / "four_ways",
            config="default",
            time_limit_s=12.0,
        )
    )
    between = Motion((0.0, 3.0), ((5.0, 4.0, 0.0), (5.0, 8.0, 0.0)), phase_s=None)
    cart = MovingObstacle(Cylinder("cart", 0.0, 0.0, 0.3, 2.0), between)
    scene = dataclasses.replace(meeting.scene, moving=(cart,), walkers=Walkers(2, reacting=True))
    meeting = dataclasses.replace(meeting, scene=scene)
    alone, shared = Track(), Track()
    summary = fly(meeting, [alone])
    assert figures(fly(meeting, [shared], processes=3)) == figures(summary)
    assert np.array_equal(alone.rows, shared.rows)
    assert worker_processes() == []


def test_a_worker_process_that_dies_ends_the_flight_with_the_reason():
    class Killer(FlightObserver):
        def on_move(self, flight):
            if flight.now_s > 0.5:
                worker_processes()[0].kill()

    with pytest.raises(WorkerProcessError, match="1 navigators failed: it has ended"):
        fly(read_setup(options()), [Killer()], processes=2)
    assert worker_processes() == []


def test_an_exception_in_a_worker_process_is_raised_with_its_traceback(monkeypatch):
    monkeypatch.setattr(NavigatorGroup, "navigate", lambda *_: 1 / 0)
    flight = Flight(read_setup(options()), processes=2)
    flight.loop.group.navigate = lambda *_: []
    with pytest.raises(WorkerProcessError, match="(?s)Traceback.*ZeroDivisionError"):
        flight.advance()
    flight.end()


def test_an_observer_that_needs_a_single_process_finds_all_navigators():
    class Inside(FlightObserver):
        needs_single_process = True
        seen = set()

        def on_start(self, flight):
            assert list(flight.offline_robots) == [0, 1]

        def on_scan(self, robot, scan, map_from_lidar):
            self.seen.add(robot)

    fly(read_setup(options(time_limit_s=0.1)), [Inside()], processes=2)
    assert Inside.seen == {0, 1}


def test_a_short_mission_is_flown_to_its_end(tmp_path):
    goals = write_goals(tmp_path, [1.5, 3.0])
    summary = fly(read_setup(options(goals=goals, time_limit_s=30.0)))
    assert summary.success and summary.exit_status == 0
    assert summary.robots[0].legs[0].reached
    assert summary.robots[0].min_separation_m is None and summary.min_separation_m is None
    assert 0.0 < summary.robots[0].min_clearance_m < 1.5


def test_goals_with_a_yaw_are_reached_facing_it_and_a_robot_stays_for_its_wait(tmp_path):
    """From (1.5, 1.5) upwards, a turn to face backwards, 3 s, and again after the last goal."""
    stay = {"x": 1.5, "y": 2.2, "yaw": -1.5, "wait_s": 3.0}
    goals = write_goals(tmp_path, stay, {"x": 1.5, "y": 2.2, "yaw": 1.5, "wait_s": 2.0})
    setup = read_setup(options(goals=goals, config="default", time_limit_s=60.0))
    flight, ended = Flight(setup), {}
    while not flight.is_done:
        legs = len(flight.log.robots["quad0"].legs)
        flight.advance()
        if len(flight.log.robots["quad0"].legs) > legs:
            ended[legs] = flight.now_s, next(iter(flight.states)).map_from_base.to_2d()
    sent_s = flight.log.robots["quad0"].legs[1].time_s
    flight.end()
    for index, yaw_rad in ((0, -1.5), (1, 1.5)):
        assert abs(angle_difference(ended[index][1].yaw_rad, yaw_rad)) <= 0.1
        assert ended[index][1].distance_to(Pose2D(1.5, 2.2)) <= 0.4
    assert ended[1][0] - sent_s - ended[0][0] == pytest.approx(3.0, abs=0.03)
    assert flight.now_s - ended[1][0] == pytest.approx(2.0, abs=0.03)


def test_two_robots_that_face_each_other_turn_and_resume():
    """Wide inflation and one command per second: they once faced each other for minutes."""
    wide = tuple((f"{costmap}_costmap/inflation_radius", 1.2) for costmap in ("global", "local"))
    jitter = SimulationParams(jitter_m=0.3)
    setup = read_setup(options(seed=3, parameters=wide, time_limit_s=150.0, simulation=jitter))
    summary = fly(setup)
    assert summary.reason == "" and summary.success


def test_a_flight_out_of_time_or_stopped_reports_the_reason():
    assert fly(read_setup(options(time_limit_s=0.5))).reason == "time limit of 0.5 s"
    stopped = fly(read_setup(options()), [Stop()])
    assert stopped.reason == "interrupted" and stopped.sim_time_s == pytest.approx(0.025)
    assert [leg.reason for leg in stopped.robots[0].legs] == ["interrupted", "not sent", "not sent"]


def test_every_fault_is_reported_at_once(tmp_path):
    goals = write_goals(tmp_path, [5.9, 5.9])
    with pytest.raises(InputError) as error:
        read_setup(options(goals=goals, config="tutrial", scans_per_s=7.0, robots=2))
    told = "\n".join(error.value.problems)
    assert "lidar_rate: is 7.0; expected scans per second that divide 240" in told
    assert "did you mean tutorial?" in told
    assert "quad1_goals.json" in told
    assert "is inside an obstacle" in told


def test_frames_that_the_simulation_lacks_are_refused():
    with pytest.raises(InputError, match="quad0: global_frame: world; expected map or odom0"):
        read_setup(options(parameters=(("local_costmap/global_frame", "world"),)))


def test_without_files_a_random_mission_is_made_and_the_costmaps_cover_it():
    setup = read_setup(options(scene=None, goals=None, robots=10))
    assert len(setup.robots) == len(setup.scene.starts) == 10
    assert setup.scene.size_x_m == 19.0
    assert {one.global_costmap.width_m for one in setup.configurations} == {19.0}
    assert setup.scene == read_setup(options(scene=None, goals=None, robots=10)).scene


def test_the_kernel_and_the_engine_see_the_same_flight():
    """Ranges differ by parts of a millimetre, so the flights do not diverge in a few seconds."""
    tracks = []
    for caster in ("kernel", "bullet"):
        params = dataclasses.replace(options().simulation, lidar_caster=caster)
        track = Track()
        fly(read_setup(options(simulation=params)), [track])
        tracks.append(np.array(track.rows)[:, :, :2])
    assert np.abs(tracks[0] - tracks[1]).max() < 0.02
