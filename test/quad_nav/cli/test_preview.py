"""The preview of a mission, and the page that edits its goals."""

from __future__ import annotations

import http.client
import json
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from quad_nav.cli.goal_editor import GoalEditor, GoalServer
from quad_nav.cli.preview import preview as command
from quad_nav.errors import InputError
from quad_nav.grid import INSCRIBED, LETHAL
from quad_nav.mission.goal_file import parse_goals
from quad_nav.report.preview_page import page_data
from quad_nav.report.preview_picture import cost_colours, preview_picture
from quad_nav.report.scene_drawing import MOVING
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.scenario.preview import MissionPreview

SOURCES = Path(__file__).resolve().parents[3] / "src"
SCENE = """
name: hall
size: [8.0, 6.0]
altitude: 1.0
walls: {height: 2.0, thickness: 0.1}
obstacles:
  - {name: pillar, shape: cylinder, centre: [4.0, 3.0], radius: 0.5, height: 2.0}
starts: [[1.0, 1.0, 0.0], [7.0, 5.0, 3.14]]
"""
GOALS = '{\n  "retries": 2,\n  "goals": [\n    [1.0, 5.0],\n    [7.0, 3.50, 1.57]\n  ]\n}\n'
INSIDE = "is inside an obstacle; expected 0.30 m of free space around it"


@pytest.fixture
def hall(tmp_path):
    """Scene and goal files of two robots; the options that read them."""
    (tmp_path / "hall.yaml").write_text(SCENE)
    for robot in (0, 1):
        (tmp_path / f"quad{robot}_goals.json").write_text(GOALS)
    return FlightOptions(tmp_path / "hall.yaml", tmp_path)


def write_goals(options, robot, goals):
    (options.goals / f"quad{robot}_goals.json").write_text(json.dumps({"goals": goals}))


def edits(*goals):
    return [dict(zip(("source", "x", "y", "yaw"), goal)) for goal in goals]


# What is shown.


def test_costmap_is_that_of_the_whole_scene_with_the_configuration_s_inflation(hall):
    costmap = MissionPreview(hall).costmap(0)

    def cost(x_m, y_m):
        column, row = costmap.spec.cell_of(x_m, y_m)
        return costmap.costs[row, column]

    assert cost(4.0, 3.0) == LETHAL
    assert cost(4.0 + 0.5 + 0.9 * costmap.inscribed_radius_m, 3.0) == INSCRIBED
    assert cost(0.01, 3.0) == LETHAL  # the wall's surface
    assert cost(2.5, 3.0) == 0
    assert 0 < cost(4.0 + 0.5 + costmap.inscribed_radius_m + 0.1, 3.0) < INSCRIBED


def test_robots_with_equal_costmaps_share_one(hall):
    preview = MissionPreview(hall)
    assert preview.costmap(0) is preview.costmap(1)


def test_plans_lead_from_goal_to_goal_around_obstacles(hall):
    write_goals(hall, 0, [[1.0, 3.0], [7.0, 3.0]])
    robot = MissionPreview(hall).robot(0)
    assert robot.faults == ("", "")
    assert robot.warnings == ()
    first, second = robot.plans
    assert first[-1] == pytest.approx((1.0, 3.0))
    assert (second[0], second[-1]) == (
        pytest.approx((1.0, 3.0), abs=0.06),
        pytest.approx((7.0, 3.0)),
    )
    assert np.hypot(*(second - (4.0, 3.0)).T).min() > 0.5 + 0.3


def test_faulty_goals_are_shown_with_the_fault_that_fly_reports(hall):
    write_goals(hall, 0, [[1.0, 5.0], [4.0, 3.0], [9.0, 3.0]])
    with pytest.raises(InputError) as refused:
        read_setup(hall)
    preview = MissionPreview(hall)
    assert preview.problems == tuple(refused.value.problems)
    assert preview.numbers == [0, 1]
    robot = preview.robot(0)
    assert robot.faults[:2] == ("", INSIDE)
    assert robot.faults[2].startswith("is outside the arena")
    assert [len(plan) > 0 for plan in robot.plans] == [True, False, False]


def test_goals_are_checked_with_the_body_of_the_configuration(hall):
    write_goals(hall, 0, [[4.0, 3.9]])
    wide = replace(hall, parameters=(("body_radius", 0.45),))
    preview = MissionPreview(wide)
    assert preview.robot_radius_m == 0.45
    (fault,) = preview.robot(0).faults
    assert "expected at least the robot's radius, 0.45 m" in fault
    assert len(preview.problems) == 1 and fault in preview.problems[0]


def test_a_goal_without_a_path_is_warned_about(hall):
    walled = SCENE.replace(
        "obstacles:\n",
        """obstacles:
  - {name: fence, shape: box, centre: [6.0, 3.0], size: [0.2, 6.0], height: 2.0}
""",
    )
    hall.scene.write_text(walled)
    robot = MissionPreview(hall).robot(0)
    assert [len(plan) > 0 for plan in robot.plans] == [True, False]
    assert len(robot.warnings) == 1
    assert robot.warnings[0].startswith("quad0: goal 2 (7, 3.5): no path from goal 1 ")


def test_a_scene_with_too_many_cells_is_shown_without_its_costmap(hall):
    hall.scene.write_text(SCENE.replace("[8.0, 6.0]", "[80000.0, 60000.0]"))
    rolling = replace(hall, parameters=(("global_costmap/rolling_window", True),))
    preview = MissionPreview(rolling)
    assert preview.costmap(0) is None
    assert preview.robot(0).warnings == (
        "quad0: no costmap and no plans: the scene has too many cells",
    )


def test_a_rolling_costmap_covers_the_scene(hall):
    rolling = replace(hall, parameters=(("global_costmap/rolling_window", True),))
    spec = MissionPreview(rolling).costmap(0).spec
    assert (spec.origin_x_m, spec.origin_y_m) == (-0.1, -0.1)
    assert (spec.size_x * spec.resolution_m, spec.size_y * spec.resolution_m) == pytest.approx(
        (8.2, 6.2)
    )


def test_what_cannot_be_read_is_left_out(hall):
    (hall.goals / "quad1_goals.json").write_text("{")
    preview = MissionPreview(hall)
    assert preview.numbers == [0]
    assert any("quad1_goals.json" in problem for problem in preview.problems)
    hall.scene.write_text("size: 3")
    preview = MissionPreview(hall)
    assert preview.scene is None
    assert preview.robot(0).plans[0].size == 0


def test_costs_have_the_colours_of_rviz():
    colours = cost_colours(np.array([[0, 1, 252, INSCRIBED, LETHAL]], dtype=np.uint8))[0]
    assert colours[:, :3].tolist()[1:] == [[0, 0, 255], [255, 0, 0], [0, 255, 255], [255, 0, 255]]
    assert colours[0, 3] == 0 < colours[1, 3]


@pytest.mark.parametrize(
    "suffix, start", [(".png", b"\x89PNG"), (".svg", b"<?xml"), (".html", b"<!DOCTYPE html>")]
)
def test_command_writes_the_picture_and_returns_the_status_of_fly(hall, tmp_path, suffix, start):
    output = tmp_path / f"out{suffix}"
    words = ["--scene", str(hall.scene), "--goals", str(hall.goals), "-o", str(output)]
    assert CliRunner().invoke(command, words).exit_code == 0
    assert output.read_bytes().startswith(start)
    write_goals(hall, 0, [[4.0, 3.0]])
    refused = CliRunner().invoke(command, words)
    assert refused.exit_code == 2
    assert f"goals[0] (goal 1): (4, 3) {INSIDE}" in refused.output


def test_command_refuses_other_names(tmp_path):
    result = CliRunner().invoke(command, ["-o", str(tmp_path / "out.jpg")])
    assert result.exit_code == 2
    assert "expected a name in .png, .svg, .html" in result.output


def test_moving_obstacles_are_drawn_where_they_start_with_their_paths(hall):
    cart = """
  - name: cart
    shape: box
    size: [1.0, 0.5]
    height: 2.0
    motion: {keyframes: [{time: 0.0, x: 1.0, y: 2.0}, {time: 8.0, x: 5.0, y: 2.0}]}
walkers: {count: 2}
starts"""
    hall.scene.write_text(SCENE.replace("\nstarts", cart))
    preview = MissionPreview(hall)
    assert preview.problems == ()
    assert [solid.name for solid in preview.moving] == ["cart", "person_0", "person_1"]
    assert (preview.moving[0].x_m, preview.moving[0].y_m) == (1.0, 2.0)
    (axes, *_) = preview_picture(preview, [preview.robot(0)], "hall").axes
    brown = [line for line in axes.lines if line.get_color() == MOVING]
    assert [line.get_xydata()[[0, -1]].tolist() for line in brown] == [[[1.0, 2.0], [5.0, 2.0]]]
    data = page_data(preview, [preview.robot(0)], "hall")
    assert [[path[0], path[-1]] for path in data["motions"]] == [[[1.0, 2.0], [5.0, 2.0]]]
    cart, *people = data["moving"]
    assert np.mean(cart[:4], axis=0) == pytest.approx([1.0, 2.0])
    assert [np.mean(person[:-1], axis=0) for person in people] == [
        pytest.approx([solid.x_m, solid.y_m], abs=1e-3) for solid in preview.moving[1:]
    ]


def test_people_without_room_are_a_problem(hall):
    hall.scene.write_text(SCENE.replace("\nstarts", "\nwalkers: {count: 200, radius: 0.5}\nstarts"))
    preview = MissionPreview(hall)
    assert preview.moving == ()
    assert "no room for person" in "".join(preview.problems)


# The page that edits.


@pytest.fixture
def server(hall):
    with GoalServer(GoalEditor(hall, MissionPreview(hall), "hall")) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def ask(server, method, path, body=None, **headers):
    """Send a request as the page's own script would, apart from the headers given."""
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    host = f"127.0.0.1:{server.server_port}"
    own = {"Host": host, "Origin": f"http://{host}", "Content-Type": "application/json"}
    own.update({name.replace("_", "-"): value for name, value in headers.items()})
    content = body if isinstance(body, (str, type(None))) else json.dumps(body)
    connection.request(method, path, content, {k: v for k, v in own.items() if v is not None})
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    return answer, text


def page_data_of(server):
    answer, text = ask(server, "GET", f"/{server.token}/", Origin=None)
    assert answer.status == 200
    data = text.split('id="data">', 1)[1].split("</script>", 1)[0]
    return json.loads(data), answer


def post(server, name, body):
    answer, text = ask(server, "POST", f"/{server.token}/{name}", body)
    assert answer.status == 200, text
    return json.loads(text)


@pytest.mark.parametrize("sent", ["", "GET", "GET page", "POST body"])
def test_a_client_that_leaves_leaves_no_traceback(server, capsys, monkeypatch, sent):
    host = f"127.0.0.1:{server.server_port}"
    post = (
        f"POST /{server.token}/check HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\n"
        "Content-Type: application/json\r\nContent-Length: 1000\r\n\r\n{"
    )
    get = f"GET /{server.token}/ HTTP/1.1\r\nHost: {host}\r\n\r\n"
    has_begun, may_go_on, ended = threading.Event(), threading.Event(), threading.Event()
    make_page, shut_down = server.editor.page, server.shutdown_request

    def page(nonce):
        has_begun.set()
        assert may_go_on.wait(20)
        return make_page(nonce)

    monkeypatch.setattr(server.editor, "page", page)
    monkeypatch.setattr(
        server, "shutdown_request", lambda request: (shut_down(request), ended.set())
    )
    with socket.create_connection(("127.0.0.1", server.server_port)) as client:
        client.sendall({"GET page": get, "POST body": post}.get(sent, sent).encode())
        if sent == "GET page":
            assert has_begun.wait(20)
        # It leaves with a reset, as a browser that is killed.
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    may_go_on.set()
    assert ended.wait(20)
    assert capsys.readouterr().err == ""


def test_a_fault_of_the_editor_is_reported(server, capsys, monkeypatch):
    monkeypatch.setattr(server.editor, "page", lambda nonce: 1 // 0)
    with pytest.raises(http.client.RemoteDisconnected):
        page_data_of(server)
    assert "ZeroDivisionError" in capsys.readouterr().err


def test_a_dragged_goal_is_checked_and_saved(server, hall):
    data, answer = page_data_of(server)
    assert "connect-src 'self'" in answer.headers["Content-Security-Policy"]
    version = data["robots"][0]["version"]
    moved = {
        "robot": 0,
        "version": version,
        "goals": edits((0, 1.0, 5.0, None), (1, 6.0, 2.0, 1.57)),
    }
    checked = post(server, "check", moved)
    assert (checked["faults"], checked["problems"]) == (["", ""], [])
    assert checked["plans"][1][-1] == [6.0, 2.0]
    saved = post(server, "save", {"robots": [moved]})
    assert (saved["problems"], saved["remaining"]) == ([], [])
    path = hall.goals / "quad0_goals.json"
    assert path.read_text() == GOALS.replace("[7.0, 3.50, 1.57]", "[6.0, 2.0, 1.57]")
    # The page goes on with the new version, and an old page does not overwrite it.
    again = {**moved, "version": saved["versions"]["0"], "goals": moved["goals"][:1]}
    assert post(server, "save", {"robots": [again]})["problems"] == []
    assert len(parse_goals(path.read_bytes(), "it").goals) == 1
    (problem,) = post(server, "save", {"robots": [moved]})["problems"]
    assert "has changed since the page was loaded" in problem


def test_a_faulty_place_is_refused_as_by_fly_and_nothing_is_written(server, hall):
    data, _ = page_data_of(server)
    bad, good = (
        {
            "robot": robot,
            "version": data["robots"][robot]["version"],
            "goals": edits((0, x, 3.0, None)),
        }
        for robot, x in ((0, 4.0), (1, 2.0))
    )
    assert post(server, "check", bad)["faults"] == [INSIDE]
    saved = post(server, "save", {"robots": [good, bad]})
    path = hall.goals / "quad0_goals.json"
    assert saved["problems"] == [f"{path}: goals[0] (goal 1): (4, 3) {INSIDE}"]
    assert [(hall.goals / f"quad{i}_goals.json").read_text() for i in (0, 1)] == [GOALS, GOALS]


def test_a_moved_goal_keeps_its_further_keys(server, hall):
    path = hall.goals / "quad0_goals.json"
    path.write_text('{"goals": [{"x": 1.0, "y": 5.0, "wait_s": 10}], "loop": false}')
    data, _ = page_data_of(server)
    version = data["robots"][0]["version"]
    moved = {"robot": 0, "version": version, "goals": edits((0, 2.0, 5.0, 1.5))}
    assert post(server, "save", {"robots": [moved]})["problems"] == []
    text = '{"goals": [{"x": 2.0, "y": 5.0, "wait_s": 10, "yaw": 1.5}], "loop": false}'
    assert path.read_text() == text


def test_a_file_that_changed_meanwhile_is_not_overwritten(server, hall):
    data, _ = page_data_of(server)
    write_goals(hall, 0, [[2.0, 2.0]])
    moved = {
        "robot": 0,
        "version": data["robots"][0]["version"],
        "goals": edits((0, 1.0, 4.0, None)),
    }
    (problem,) = post(server, "save", {"robots": [moved]})["problems"]
    assert "has changed since the page was loaded" in problem
    reloaded, _ = page_data_of(server)
    assert [goal["x"] for goal in reloaded["robots"][0]["goals"]] == [2.0]


@pytest.mark.parametrize(
    "request_",
    [
        None,
        {"robot": "0", "goals": []},
        {"robot": 0, "goals": {}},
        {"robot": 0, "goals": ["x"]},
        {"robot": 0, "goals": edits((True, 1.0, 1.0, None))},
        {"robot": 0, "goals": edits((None, "1", 1.0, None))},
        {"robot": 0, "goals": edits((None, 1.0, 1.0, "east"))},
        {"robot": 0, "goals": [], "version": "old"},
        {"robot": 7, "goals": []},
    ],
)
def test_requests_that_are_not_valid_are_refused(hall, request_):
    editor = GoalEditor(hall, MissionPreview(hall), "hall")
    assert editor.check(request_)["problems"]
    assert editor.save({"robots": [request_]})["problems"]
    assert editor.save(request_)["problems"]


@pytest.mark.parametrize(
    "headers, status",
    [
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": None}, 403),
        ({"Host": "evil.example"}, 403),
        ({"Content_Type": "text/plain"}, 400),
        ({"Content_Length": "99999999999"}, 400),
    ],
)
def test_requests_of_other_pages_are_refused(server, headers, status):
    answer, _ = ask(server, "POST", f"/{server.token}/save", "{}", **headers)
    assert answer.status == status


def test_the_address_has_a_secret_part(server):
    assert ask(server, "GET", "/", Origin=None)[0].status == 404
    assert ask(server, "POST", "/save", "{}")[0].status == 404
    assert ask(server, "GET", f"/{server.token}/", Origin=None, Host="localhost")[0].status == 403
    assert server.url.startswith("http://127.0.0.1:")
    assert len(server.token) >= 32


def test_ctrl_c_ends_the_server_without_a_fault(hall):
    words = ["preview", "--edit", "--scene", str(hall.scene), "--goals", str(hall.goals)]
    with subprocess.Popen(
        [sys.executable, "-m", "quad_nav.cli", *words],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(SOURCES)},
    ) as process:
        assert b"edit the goals at http://127.0.0.1:" in process.stdout.readline()
        process.send_signal(signal.SIGINT)
        assert process.stdout.read() == b"preview: ended\n"
    assert process.returncode == 0


def test_random_missions_have_no_files_to_edit():
    options = FlightOptions(None, None, robots=3)
    with pytest.raises(InputError, match="no goal files"):
        GoalEditor(options, MissionPreview(options), "random")
