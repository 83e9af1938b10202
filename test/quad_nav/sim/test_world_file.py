"""Gazebo worlds: poses computed by hand, remarks, and faults."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from quad_nav.errors import InputError
from quad_nav.sim.obstacles import Box, Cylinder, Sphere
from quad_nav.sim.scene_file import load_scene
from quad_nav.sim.world_file import load_world

BOX = "<box><size>1 2 3</size></box>"
CYLINDER = "<cylinder><radius>0.5</radius><length>2</length></cylinder>"
SPHERE = "<sphere><radius>0.5</radius></sphere>"
QUARTER = math.pi / 2


def model(
    shape: str,
    pose: str = "0 0 0 0 0 0",
    name: str = "m",
    link: str = "",
    more: str = "",
    static: str = "true",
) -> str:
    return (
        f'<model name="{name}"><static>{static}</static><pose>{pose}</pose><link name="l">'
        f'{link}<collision name="c">{more}<geometry>{shape}</geometry></collision></link>'
        "</model>"
    )


LOST = "that is not found, not in GAZEBO_MODEL_PATH either"
CASES = Path(__file__).parents[2] / "field_cases"


def written(folder: Path, *content: str, name: str = "a.world") -> Path:
    path = folder / name
    path.write_text(f'<sdf version="1.6">\n<world name="w">\n{"".join(content)}\n</world></sdf>')
    return path


def only(folder: Path, *content: str):
    world = load_world(written(folder, *content))
    assert world.remarks == ()
    (obstacle,) = world.obstacles
    return obstacle


def remarks(folder: Path, *content: str) -> list:
    path = written(folder, *content)
    return [remark[len(f"{path}: ") :] for remark in load_world(path).remarks]


def faults(path: Path) -> list:
    with pytest.raises(InputError) as caught:
        load_world(path)
    return [problem.replace(str(path), path.name) for problem in caught.value.problems]


def same(obstacle, other) -> None:
    assert type(obstacle) is type(other) and obstacle.name == other.name
    values, expected = (
        [v for v in vars(o).values() if not isinstance(v, str)] for o in (obstacle, other)
    )
    assert values == pytest.approx(expected, abs=1e-9)


def actor(script: str, name: str = "ann", pose: str = "") -> str:
    return f'<actor name="{name}">{pose}<script>{script}</script></actor>'


def waypoint(time_s: float, pose: str) -> str:
    return f"<waypoint><time>{time_s}</time><pose>{pose}</pose></waypoint>"


def trajectory(*waypoints: str, more: str = "") -> str:
    return f'<trajectory id="0" type="walking"{more}>{"".join(waypoints)}</trajectory>'


TO_AND_FRO = trajectory(
    waypoint(0, "1 2 1.0 0 0 0"), waypoint(4, "5 2 1.0 0 0 1.5"), waypoint(8, "1 2 1.0 0 0 0")
)


def test_an_actor_walks_along_its_waypoints(tmp_path):
    world = load_world(written(tmp_path, actor(TO_AND_FRO)))
    assert world.obstacles == () and world.remarks == ()
    (one,) = world.moving
    assert one.shape == Cylinder("ann", 1.0, 2.0, 0.25, 1.75)
    assert one.motion.times_s == (0.0, 4.0, 8.0)
    assert [pose[:2] for pose in one.motion.poses] == [(1.0, 2.0), (5.0, 2.0), (1.0, 2.0)]
    assert (one.motion.loop, one.motion.interpolation, one.motion.tension) == (True, "spline", 0.0)


def test_delay_loop_tension_and_a_second_trajectory(tmp_path):
    """The second trajectory begins when the first one ends; waypoints are sorted by time."""
    later = trajectory(waypoint(3, "5 4 0 0 0 0"), waypoint(1, "5 3 0 0 0 0"))
    script = "<loop>false</loop><delay_start>2</delay_start>"
    first = trajectory(waypoint(0, "5 1 0 0 0 0"), waypoint(4, "5 2 0 0 0 0"))
    (one,) = load_world(written(tmp_path, actor(script + first + later))).moving
    assert one.motion.times_s == (2.0, 6.0, 7.0, 9.0)
    assert [pose[1] for pose in one.motion.poses] == [1.0, 2.0, 3.0, 4.0]
    assert not one.motion.loop
    stiff = TO_AND_FRO.replace('type="walking"', 'type="walking" tension="0.6"')
    (one,) = load_world(written(tmp_path, actor(stiff))).moving
    assert one.motion.tension == 0.6


@pytest.mark.parametrize("script", ["", "<auto_start>false</auto_start>" + TO_AND_FRO])
def test_an_actor_without_a_walk_stands(tmp_path, script):
    pose = "<pose>3 4 1 0 0 0</pose>"
    assert only(tmp_path, actor(script, pose=pose)) == Cylinder("ann", 3.0, 4.0, 0.25, 1.75)


def test_a_scene_of_a_world_has_its_actors(tmp_path):
    """The arena holds the waypoints; equal names are numbered."""
    path = written(tmp_path, model(BOX, "0 5 1.5 0 0 0"), actor(TO_AND_FRO), actor(TO_AND_FRO))
    scene = load_scene(path)
    assert [one.shape.name for one in scene.moving] == ["ann", "ann_2"]
    assert scene.end_x_m == pytest.approx(5.25)
    assert scene.origin_y_m == pytest.approx(1.75)


@pytest.mark.parametrize(
    "script, problem",
    [
        (
            trajectory("<waypoint><pose>1 2 0 0 0 0</pose></waypoint>"),
            "<waypoint>: <time> is missing, expected seconds",
        ),
        (
            trajectory(waypoint(-1, "1 2 0 0 0 0")),
            "<time>: '-1', expected seconds, 0 or more",
        ),
        (
            trajectory(waypoint(0, "1 2 0 0 0 0"), more=' tension="nan"'),
            "<trajectory>: tension 'nan', expected a number from 0 to 1",
        ),
    ],
)
def test_an_actor_with_a_fault_is_left_out(tmp_path, script, problem):
    assert remarks(tmp_path, actor(script)) == [f"1 left out, a.world: line 3: {problem}: ann"]


def test_parts_below_the_floor_are_cut_off(tmp_path):
    same(only(tmp_path, model(BOX, "0 0 0.5 0 0 0")), Box("m/l/c", 0.0, 0.0, 1.0, 2.0, 2.0))
    same(only(tmp_path, model(CYLINDER, "0 0 0 0 0 0")), Cylinder("m/l/c", 0.0, 0.0, 0.5, 1.0))
    same(only(tmp_path, model(SPHERE)), Sphere("m/l/c", 0.0, 0.0, 0.0, 0.5))


def test_poses_are_composed_from_model_to_collision(tmp_path):
    # A quarter turn about z takes the link's (1, 0) to (0, 1), another the collision's to (-1, 0).
    link, collision = (f"<pose>{x} 0 1 0 0 {QUARTER}</pose>" for x in (1, 2))
    box = only(tmp_path, model(BOX, f"10 20 0 0 0 {QUARTER}", link=link, more=collision))
    same(box, Box("m/l/c", 8.0, 21.0, 1.0, 2.0, 3.0, -QUARTER, 0.5))


def test_nested_models(tmp_path):
    inner = model(SPHERE, "1 0 2 0 0 0", name="inner")
    sphere = only(
        tmp_path,
        f'<model name="outer"><static>1</static><pose>5 5 0 0 0 {QUARTER}</pose>{inner}</model>',
    )
    same(sphere, Sphere("outer/inner/l/c", 5.0, 6.0, 2.0, 0.5))


@pytest.mark.parametrize(
    "angles, size_x, size_y, height, yaw",
    [
        (f"{QUARTER} 0 0", 3.0, 1.0, 2.0, QUARTER),  # y stands up, z lies along -y
        (f"0 {QUARTER} 0", 2.0, 3.0, 1.0, QUARTER),  # x points down, z lies along x
        (f"{math.pi} 0 0", 1.0, 2.0, 3.0, 0.0),
        (f"{QUARTER} 0 0.3", 3.0, 1.0, 2.0, QUARTER + 0.3),
    ],
)
def test_boxes_may_lie_on_any_side(tmp_path, angles, size_x, size_y, height, yaw):
    box = only(tmp_path, model(BOX, f"0 0 5 {angles}"))
    assert (box.size_x_m, box.size_y_m, box.height_m) == (size_x, size_y, height)
    assert math.sin(2 * (box.yaw_rad - yaw)) == pytest.approx(0.0, abs=1e-9)
    assert math.cos(2 * (box.yaw_rad - yaw)) == pytest.approx(1.0)
    assert box.bottom_m == pytest.approx(5.0 - height / 2)


@pytest.mark.parametrize(
    "pose", ['degrees="true">0 0 2 0 0 90', 'rotation_format="quat_xyzw">0 0 2 0 0 1 1']
)
def test_degrees_and_quaternions(tmp_path, pose):
    box = only(tmp_path, model(BOX).replace("<pose>0 0 0 0 0 0", f"<pose {pose}"))
    assert box.yaw_rad == pytest.approx(QUARTER)


def test_ground_plane_and_sun_are_floor_and_light(tmp_path):
    plane = "<plane><normal>0 0 1</normal><size>100 100</size></plane>"
    includes = "".join(
        f"<include><uri>model://{name}</uri></include>" for name in ("ground_plane", "sun")
    )
    assert only(tmp_path, model(plane, name="ground"), includes, model(SPHERE)).name == "m/l/c"


@pytest.mark.parametrize(
    "content, remark",
    [
        (model("<mesh><uri>a.dae</uri></mesh>"), f"1 left out, mesh {LOST}: m/l/c"),
        (model("<a/>") + model("<a/>", name="n"), "2 left out, a: m/l/c, n/l/c"),
        (model("<plane/>", "0 0 1 0 0 0"), "1 left out, plane that is not the floor: m/l/c"),
        (model(BOX, "0 0 -1.5 0 0 0"), "1 left out, nothing above the floor: m/l/c"),
        (
            model(BOX, more='<pose relative_to="f">0 0 0 0 0 0</pose>'),
            "1 left out, pose relative to a named frame: m/l/c",
        ),
        (
            "<include><name>t</name><uri>model://no_table</uri></include>",
            f"1 left out, <include> {LOST}: t (model://no_table)",
        ),
        (
            "<include><uri>model://../a</uri></include>",
            f"1 left out, <include> {LOST}: a (model://../a)",
        ),
        (
            '<model name="m"><static>1</static><link name="l"><visual name="v"/></link></model>',
            "1 left out, looks without a collision: m/l",
        ),
        (
            '<actor name="walker"><plugin name="p" filename="p.so"/></actor>',
            "1 left out, actor that a plugin moves: walker",
        ),
        ('<road name="r"/>', "1 left out, road: r"),
        (model(BOX, static="false"), "not static in Gazebo, but fixed here: m"),
    ],
)
def test_a_remark_names_what_is_left_out(tmp_path, content, remark):
    assert remarks(tmp_path, content) == [remark]


def test_a_saved_state_overrides_poses(tmp_path):
    state = (
        '<state world_name="w"><model name="m"><pose>1 2 3 0 0 0</pose><link name="l">'
        "<pose>7 8 9 0 0 0</pose></link></model></state>"
    )
    same(only(tmp_path, model(SPHERE), state), Sphere("m/l/c", 7.0, 8.0, 9.0, 0.5))
    scaled = state.replace("<pose>1", "<scale>2 2 2</scale><pose>1")
    assert remarks(tmp_path, model(SPHERE), scaled) == ["1 left out, scaled in <state>: m"]


def test_includes_are_found_beside_the_world_and_in_the_model_path(tmp_path, monkeypatch):
    def place(folder: Path, radius: float) -> None:
        folder.mkdir(parents=True)
        (folder / "model.config").write_text(
            '<model><sdf version="1.10">new.sdf</sdf><sdf version="1.9">old.sdf</sdf></model>'
        )
        (folder / "new.sdf").write_text(
            f"<sdf>{model(SPHERE.replace('0.5', str(radius)), '9 9 9 0 0 0')}</sdf>"
        )

    place(tmp_path / "elsewhere" / "ball", 0.25)
    include = "<include><uri>model://ball</uri><name>b</name><pose>1 2 3 0 0 0</pose></include>"
    path = written(tmp_path, include, include, model(CYLINDER, "9 9 1 0 0 0"))
    monkeypatch.setenv("GAZEBO_MODEL_PATH", f"/nowhere:{tmp_path / 'elsewhere'}")
    assert load_scene(path).obstacles[:2] == (
        Sphere("b/l/c", 1.0, 2.0, 3.0, 0.25),
        Sphere("b/l/c_2", 1.0, 2.0, 3.0, 0.25),
    )
    place(tmp_path / "models" / "ball", 0.75)
    assert load_scene(path).obstacles[0].radius_m == 0.75


def test_a_model_that_includes_itself_is_left_out(tmp_path):
    include = "<include><uri>model://a.world</uri></include>"
    path = tmp_path / "a.world"
    path.write_text(f'<sdf>\n<model name="m">{include}</model></sdf>')
    remark, _ = load_world(path).remarks
    assert "left out, a.world: line 2: <include>: more than 16 nested files: m/" in remark


@pytest.mark.parametrize(
    "content, problem",
    [
        (
            model("<box><size>1 2</size></box>"),
            "line 3: <size>: '1 2', expected three numbers of metres",
        ),
        (
            model("<sphere><radius>-1</radius></sphere>"),
            "line 3: <radius>: '-1', expected a number of metres, above 0",
        ),
        (model("<sphere/>"), "line 3: <sphere>: <radius> is missing, expected a number of metres"),
        (model(SPHERE, "0 0 0 0 0"), "line 3: <pose>: '0 0 0 0 0', expected x y z roll pitch yaw"),
        (
            model(SPHERE, "1 1 343582.7 0 0 0"),
            "line 3: <pose>: '1 1 343582.7 0 0 0', expected x y z roll pitch yaw, at most 100000",
        ),
    ],
)
def test_a_shape_with_a_fault_is_left_out_with_the_line(tmp_path, content, problem):
    path = written(tmp_path, model(BOX, name="sound"), content)
    world = load_world(path)
    assert [one.name for one in world.obstacles] == ["sound/l/c"]
    (remark,) = world.remarks
    assert remark.startswith(f"{path}: 1 left out, a.world: {problem}: m")


@pytest.mark.parametrize(
    "content, problem",
    [
        ("<model>", "line 4, column 3: mismatched tag"),
        ("</world><world name='v'>", "line 3: a second <world>, expected one"),
    ],
)
def test_faults_have_a_line(tmp_path, content, problem):
    assert faults(written(tmp_path, content)) == [f"a.world: {problem}"]


@pytest.mark.parametrize(
    "case, obstacles, remark",
    [
        ("bad_pose", 3, "1 left out, room.world: line 4: <pose>: '1 1 343582.7 0 0 0'"),
        ("bad_model_config", 4, "starts: not given"),
    ],
)
def test_one_bad_detail_does_not_refuse_a_world(case, obstacles, remark):
    scene = load_scene(CASES / case / "room.world")
    assert len(scene.obstacles) == obstacles
    assert any(remark in one for one in scene.remarks)


def test_a_world_of_meshes_says_what_was_left_out():
    with pytest.raises(
        InputError, match=f"4 left out, mesh {LOST}: .*expected a scene with world, size"
    ):
        load_scene(CASES / "meshes_only" / "room.world")


@pytest.mark.parametrize("before", ["\n ", "<!-- licence -->\n"])
def test_what_stands_before_the_declaration(tmp_path, before):
    path = written(tmp_path, model(SPHERE))
    path.write_text(f'{before}<?xml version="1.0"?>{path.read_text()}')
    assert len(load_world(path).obstacles) == 1


def test_xml_bombs_are_refused(tmp_path):
    path = tmp_path / "bomb.world"
    path.write_text('<?xml version="1.0"?>\n<!DOCTYPE a [<!ENTITY b "bbbb">]>\n<sdf>&b;</sdf>')
    (problem,) = faults(path)
    assert problem.startswith("bomb.world: line 2: DOCTYPE and entities are refused")


def test_a_world_by_itself_is_a_scene(tmp_path):
    path = written(
        tmp_path,
        model(BOX, f"-3 -2 1.5 0 0 {QUARTER}", name="a"),
        model(CYLINDER, "4 4 1 0 0 0", name="b"),
    )
    scene = load_scene(path)
    assert (scene.name, scene.altitude_m, len(scene.obstacles)) == ("a", 1.0, 2)
    assert (scene.origin_x_m, scene.origin_y_m) == pytest.approx((-4.0, -2.5))
    assert (scene.end_x_m, scene.end_y_m) == pytest.approx((4.5, 4.5))
    assert scene.starts[0].x_m == pytest.approx(0.25) and scene.starts[0].y_m == pytest.approx(1.0)
    assert scene.remarks[0].startswith(
        f"{path}: starts: not given, quadcopters start at [0.25, 1.00], "
    )


def test_a_single_wall_stands_in_the_open(tmp_path):
    """The wall is 1 m along x and 2 m along y; there are 2 m of room on each side."""
    scene = load_scene(written(tmp_path, model(BOX, "5 5 1.5 0 0 0")))
    assert (scene.origin_x_m, scene.origin_y_m) == (2.5, 2.0)
    assert (scene.end_x_m, scene.end_y_m) == (7.5, 8.0)
    assert scene.starts


def test_an_empty_world_needs_a_scene_with_a_size(tmp_path):
    path = written(tmp_path)
    with pytest.raises(InputError, match="a.world: size: missing, and the world has no obstacles"):
        load_scene(path)
    scene_path = tmp_path / "s.yaml"
    scene_path.write_text("world: a.world\nsize: [4, 4]\norigin: [-2, -2]\nstarts: [[0, 0]]\n")
    assert load_scene(scene_path).contains(-1.9, -1.9)
