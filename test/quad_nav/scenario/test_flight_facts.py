"""Facts about a flight's set-up in its summary, offline and with ROS."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from quad_nav import config
from quad_nav.cli import main
from quad_nav.files.shipped import shipped
from quad_nav.mission.summary import FACTS, MissionSummary, to_json
from quad_nav.scenario import mission_setup
from quad_nav.scenario.flight_facts import offline_facts
from quad_nav.scenario.flight_setup import FlightOptions, read_setup


@pytest.fixture(scope="module")
def facts():
    """Facts of a flight with one parameter of its own."""
    options = FlightOptions(
        shipped("scenes", "arena.yaml"),
        shipped("goals"),
        parameters=(("global_costmap/width", 14.0),),
        time_limit_s=60.0,
    )
    return offline_facts(options, read_setup(options), ["quad", "fly", "--time-limit", "60"])


def differences(facts):
    return {one["parameter"]: one["value"] for one in facts["configuration"]["differences"]}


def test_facts_of_an_offline_flight(facts):
    assert set(facts) == set(FACTS)
    assert facts["command"] == ["quad", "fly", "--time-limit", "60"]
    assert facts["scene"] == {
        "name": "arena",
        "file": str(shipped("scenes", "arena.yaml")),
        "size_m": [12.0, 12.0],
        "origin_m": [0.0, 0.0],
        "obstacles": 8,
    }
    assert facts["configuration"]["name"] == "default"
    assert facts["configuration"]["set"] == {"global_costmap/width": 14.0}
    assert differences(facts)["global_costmap/width"] == 14.0
    assert facts["airframe"] == "default"
    assert (facts["goals"], facts["jitter_m"]) == ("shipped", 0.0)
    assert set(facts["odom_drift"].values()) == {0.0}
    assert facts["lidar"]["beams"] == 512 and facts["lidar"]["rate_hz"] == 20.0
    assert facts["time_limit_s"] == 60.0


def test_the_command_line_is_in_the_json(tmp_path, monkeypatch):
    arguments = ["fly", "-q", "--time-limit", "0.1", "--jitter", "0.05", "--json", "f.json"]
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["/usr/bin/quad", *arguments])
    CliRunner().invoke(main, arguments)
    written = json.loads((tmp_path / "f.json").read_text())
    assert written["command"] == ["quad", *arguments]
    assert (written["jitter_m"], written["time_limit_s"]) == (0.05, 0.1)
    assert written["configuration"]["name"] == "default"


def test_a_flight_with_ros_has_the_same_facts(tmp_path, facts):
    trees = {
        f"move_base{k}": config.load_files(shipped("config", "default"), {"i": str(k)})
        for k in range(2)
    }
    for tree in trees.values():
        tree["global_costmap"]["width"] = 14.0
    scene = str(shipped("scenes", "arena.yaml"))
    setup = mission_setup.read_setup(
        {"goals": str(shipped("goals")), "scene": scene, "config_name": "default"},
        "sequencer",
        tmp_path / "result.json",
        tmp_path,
        {**trees, "simulator": {"jitter": 0.1, "step_size": 0.1, "scan_range": 3.2}},
    )
    assert setup.facts["scene"] == facts["scene"]
    assert setup.facts["configuration"]["name"] == "default"
    assert differences(setup.facts) == differences(facts)
    assert setup.facts["jitter_m"] == 0.1
    assert setup.facts["lidar"]["beams"] == 32


def test_facts_that_nobody_knows_are_null():
    document = to_json(MissionSummary(()))
    assert [document[key] for key in FACTS] == [None] * len(FACTS)
