"""Meshes of Gazebo worlds as obstacles, with files that are written here."""

from __future__ import annotations

import math
import sys

import numpy as np
import pytest

from quad_nav.errors import InputError
from quad_nav.sim.scene_file import load_scene
from quad_nav.sim.unseen import unseen_obstacles
from quad_nav.sim.voxels import cover_volume, fill
from quad_nav.sim.world_file import load_world

CORNERS = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (0, 1)]
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLES = [part for a, b, c, d in FACES for part in ((a, b, c), (a, c, d))]


def stl(size=(1.0, 1.0, 1.0), bottom=0.0):
    """A box of twice the size along x and y, and of the size along z, as an STL."""
    lines = ["solid box"]
    for corners in TRIANGLES:
        lines += ["facet normal 0 0 0", "outer loop"]
        for corner in corners:
            x, y, z = np.multiply(CORNERS[corner], size) + (0, 0, bottom)
            lines.append(f"vertex {x} {y} {z}")
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid box"])


def obj(_=None):
    vertices = [f"v {x} {y} {z}" for x, y, z in CORNERS]
    return "\n".join(vertices + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in TRIANGLES])


def dae(metres=0.01, up="Y_UP"):
    """The same box in hundredths of a metre."""
    values = " ".join(f"{value / metres}" for corner in CORNERS for value in corner)
    indices = " ".join(str(corner) for corners in TRIANGLES for corner in corners)
    return f"""<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="u" meter="{metres}"/><up_axis>{up}</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="s"><float_array id="a" count="24">{values}</float_array><technique_common>
<accessor source="#a" count="8" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
<triangles count="12"><input semantic="VERTEX" source="#v" offset="0"/><p>{indices}</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="w"><node><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#w"/></scene></COLLADA>"""


def world_of(folder, uri="box.stl", pose="0 0 0 0 0 0", scale=""):
    path = folder / "a.world"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        f'<sdf><world name="w"><model name="m"><static>1</static><pose>{pose}</pose><link name="l">'
        f'<collision name="c"><geometry><mesh><uri>{uri}</uri>{scale}</mesh></geometry></collision>'
        "</link></model></world></sdf>"
    )
    return path


def assert_world_extent(path, expected):
    """Compare lowest and highest x, y and z of a world's boxes."""
    assert_extent(load_world(path).obstacles, expected)


def assert_extent(boxes, expected):
    outlines = np.concatenate([one.outline_m() for one in boxes])
    low, high = outlines.min(axis=0).tolist(), outlines.max(axis=0).tolist()
    heights = min(one.bottom_m for one in boxes), max(one.top_m for one in boxes)
    np.testing.assert_allclose([*zip(low, high), heights], expected, atol=1e-9)


@pytest.mark.parametrize("name, content", [("a.stl", stl()), ("a.OBJ", obj()), ("a.dae", dae())])
def test_a_mesh_of_each_format_has_its_pose_and_scale(tmp_path, name, content):
    """The box is 2 x 2 x 1 m; scaled 4 x 2 x 2 m; a quarter turn makes it 2 x 4 x 2 m."""
    (tmp_path / name).write_text(content)
    scale = "<scale>2 1 2</scale>"
    path = world_of(tmp_path, name, "5 6 0.5 0 0 1.5707963267948966", scale)
    assert_world_extent(path, [(4.0, 6.0), (4.0, 8.0), (0.5, 2.5)])


def test_a_tilted_mesh_and_the_part_above_the_floor(tmp_path):
    """Lying on its side it is 1 m along x; 0.6 m of its 2 m are below the floor."""
    (tmp_path / "box.stl").write_text(stl())
    path = world_of(tmp_path, pose="0 0 0.4 0 1.5707963267948966 0")
    assert_world_extent(path, [(0.0, 1.0), (-1.0, 1.0), (0.0, 1.4)])


def test_tilted_boxes_and_cylinders_are_surfaces_too(tmp_path):
    """A ramp of 4 x 1 x 0.2 m at 30 degrees, and a cylinder of 2 m that lies along y."""
    path = tmp_path / "a.world"
    path.write_text(
        '<sdf><model name="m"><static>1</static><link name="l"><collision name="ramp">'
        "<pose>0 0 1.5 0 0.5235987755982988 0</pose><geometry><box><size>4 1 0.2</size></box>"
        '</geometry></collision></link><link name="k"><pose>9 0 1 1.5707963267948966 0 0</pose>'
        '<collision name="c"><geometry><cylinder><radius>0.5</radius><length>2</length></cylinder>'
        "</geometry></collision></link></model></sdf>"
    )
    world = load_world(path)
    ramp = [box for box in world.obstacles if box.name.startswith("m/l/ramp")]
    log = [box for box in world.obstacles if box.name.startswith("m/k/c")]
    reach_m = 2 * math.cos(math.pi / 6) + 0.1 * math.sin(math.pi / 6)
    rise_m = 2 * math.sin(math.pi / 6) + 0.1 * math.cos(math.pi / 6)
    assert_extent(ramp, [(-reach_m, reach_m), (-0.5, 0.5), (1.5 - rise_m, 1.5 + rise_m)])
    assert_extent(log, [(8.5, 9.5), (-1.0, 1.0), (0.5, 1.5)])
    assert world.remarks == ()
    # The ramp descends along x: at x = 1 its middle is at 1.5 - tan(30 degrees) m.
    distances = [min(box.surface_distance_m(1.0, 0.0, z) for box in ramp) for z in (0.92, 1.5)]
    assert distances[0] <= 0.1 and distances[1] > 0.3


def test_a_room_of_one_mesh_is_a_room(tmp_path):
    """10 x 8 m with walls up to 2.5 m: quadcopters start inside, 5 cm of each side are wall."""
    (tmp_path / "box.stl").write_text(stl((5.0, 4.0, 2.5)))
    scene = load_scene(world_of(tmp_path))
    assert abs(scene.starts[0].x_m) < 1e-9
    assert scene.surface_distance_m(0.0, 0.0, 1.0) == pytest.approx(2.45 - 1.0)  # to the ceiling
    assert scene.surface_distance_m(4.0, 0.0, 1.0) == pytest.approx(0.95)
    assert len(scene.obstacles) == 5


def test_the_top_of_a_table_is_named_as_one_that_is_touched_unseen(tmp_path):
    (tmp_path / "box.stl").write_text(stl((1.0, 0.5, 0.04), bottom=1.0))
    scene = tmp_path / "scene.yaml"
    scene.write_text(f"world: {world_of(tmp_path).name}\nsize: [9, 9]\norigin: [-4, -4]")
    (line,) = unseen_obstacles(load_scene(scene))
    assert "quadcopters touch m/l/c_0" in line


@pytest.mark.parametrize(
    "uri, place",
    [
        ("model://crate/meshes/box.stl", "pkg/models/crate/meshes/box.stl"),
        ("model://other/meshes/box.stl", "other/meshes/box.stl"),
        ("package://other/meshes/box.stl", "other/meshes/box.stl"),
        ("model://crate/box.stl", "other/models/crate/box.stl"),
        ("file://meshes/box.stl", "pkg/worlds/meshes/box.stl"),
        ("file://{folder}/pkg/box.stl", "pkg/box.stl"),
        ("model://crate/box.stl", "elsewhere/crate/box.stl"),
    ],
)
def test_meshes_are_found_as_gazebo_finds_them(tmp_path, monkeypatch, uri, place):
    monkeypatch.setenv("GAZEBO_MODEL_PATH", str(tmp_path / "elsewhere"))
    (tmp_path / place).parent.mkdir(parents=True)
    (tmp_path / place).write_text(stl())
    path = world_of(tmp_path / "pkg" / "worlds", uri.format(folder=tmp_path))
    (tmp_path / "pkg" / "package.xml").write_text("<package/>")
    assert len(load_world(path).obstacles) == 5


@pytest.mark.parametrize(
    "name, content, reason",
    [
        ("a.dae", "<a/>", "mesh that cannot be read: "),
        ("a.ply", "ply", "mesh that is no .dae, .stl, .obj: m/l/c"),
        ("a.dae", '<!DOCTYPE a [<!ENTITY b "c">]><a/>', "expected <COLLADA> without a DOCTYPE"),
        ("a.stl", stl(bottom=-1.0), "nothing above the floor: m/l/c"),
        ("a.stl", "version https://git-lfs.github.com/spec/v1\n", "pointer is there: git lfs pull"),
        ("a.obj", obj().replace("v 1 1 1", "v 1 1 nan"), "no numbers"),
    ],
)
def test_a_mesh_with_a_fault_is_left_out(tmp_path, name, content, reason):
    (tmp_path / name).write_text(content)
    found = load_world(world_of(tmp_path, name))
    assert found.obstacles == ()
    assert reason in found.remarks[0]


@pytest.mark.parametrize("module, name", [("trimesh", "a.stl"), ("collada", "a.dae")])
def test_without_the_extra_meshes_are_counted(tmp_path, monkeypatch, module, name):
    (tmp_path / name).write_text(stl() if module == "trimesh" else dae())
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InputError) as caught:
        load_scene(world_of(tmp_path, name))
    needed = f"1 left out, mesh, which needs {module}: pip install 'quad-nav[meshes]'"
    assert needed in str(caught.value)


def test_a_world_whose_meshes_are_lost_names_the_map_of_the_package(tmp_path):
    (tmp_path / "pkg" / "maps").mkdir(parents=True)
    (tmp_path / "pkg" / "package.xml").write_text("<package/>")
    for name, content in (("amcl", "use_map: true"), ("a", "image: a.pgm"), ("b", "image: b.pgm")):
        (tmp_path / "pkg" / "maps" / f"{name}.yaml").write_text(content)
    path = world_of(tmp_path / "pkg" / "worlds")
    with pytest.raises(InputError, match=rf"--scene {tmp_path}/pkg/maps/a\.yaml"):
        load_scene(path)


def test_cells_of_a_triangle_and_the_boxes_that_cover_them():
    """The triangle stands on y = 0 in the third quarter of a cell, and reaches from z = 0 to 3."""
    filled = np.zeros((4, 2, 3), bool)
    fill(np.array([[(0.5, 0.6, 0.0), (2.5, 0.6, 0.0), (0.5, 0.6, 3.0)]]), filled)
    # At x = 1 it is 2.25 m high, at x = 2 it is 0.75 m.
    assert filled[:, 0].sum(axis=1).tolist() == [3, 3, 1, 0]
    assert not filled[:, 1].any()
    boxes = np.empty((9, 2, 3), np.int64)
    assert cover_volume(filled.copy(), boxes) == 2
    assert boxes[:2].tolist() == [[[0, 0, 0], [2, 1, 3]], [[2, 0, 0], [3, 1, 1]]]
    assert cover_volume(filled, np.empty((1, 2, 3), np.int64)) == 2
