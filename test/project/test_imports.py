"""Imports go one way: from the shells to the core, and each third party has its one place."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Dict, Iterator, List, Set

import pytest
from source_imports import SOURCES, imported_names, package_of

CORE = "quad_nav"
ADD_ONS = (
    "quad_moving",
    "quad_localization",
    "quad_vehicles",
    "quad_web",
    "quad_tune",
    "quad_bench",
    "quad_rl",
)

# A unit (a module or a package directly in the core) imports itself and units of the rows above.
# Add-ons import the core and themselves.
LAYERS = [
    {"errors"},
    {"versions"},
    {"__init__"},  # quad_nav.__version__
    {"geometry", "grid", "files", "parameter"},
    {"footprint", "timing"},
    {"costmap", "sim"},
    {"plan", "control"},
    {"recovery", "peers"},
    {"navigator", "mission"},
    {"config"},
    {"scenario"},
    {"loop", "topics"},
    {"offline", "ros"},
    {"recording", "api"},
    {"report"},
    {"cli"},
]
# Navigation and the simulator do not import each other.
WORLD_USERS = set("sim mission scenario topics loop offline recording report cli ros api".split())
# (importing module, imported add-on): an add-on imports another one in these modules alone.
BETWEEN_ADD_ONS = {
    ("quad_tune/barn_course.py", "quad_bench"),
    ("quad_tune/test_barn_course.py", "quad_bench"),
}

ROS = ("quad_nav/ros/", "quad_localization/ros/", "quad_vehicles/ros/", "quad_web/ros/")
# The files or folders in which a third-party package may be imported.
PLACES = {
    "click": ("quad_nav/cli/", "quad_web/cli/", "quad_tune/cli/", "quad_bench/cli/"),
    "rich": ("quad_nav/cli/", "quad_tune/cli/", "quad_bench/cli/"),
    "joblib": "quad_nav/offline/workers.py",
    "ray": "quad_nav/offline/workers.py",
    "pyrvo": "quad_bench/circle/orca.py",
    "optuna": "quad_tune/",
    "sqlalchemy": "quad_tune/study.py",
    "numba": "quad_nav/files/kernel_cache.py",
    "pybullet": "quad_nav/sim/body.py",
    "defusedxml": "quad_nav/files/xml_tree.py",
    "rospy": ROS,
    "rosgraph": ROS,
    "roslib": ROS,
    "actionlib": ROS,
    "dynamic_reconfigure": ROS,
    "tf2_ros": ROS,
    "lz4": ("quad_nav/recording/", "quad_web/replay/"),
    "rosbags": ("quad_nav/recording/", "quad_web/replay/"),
    "matplotlib": ("quad_nav/report/", "quad_tune/report/", "quad_bench/circle/picture.py"),
    "jinja2": "quad_nav/report/",
    "plotly": "quad_nav/report/",
    "pandas": "quad_nav/api/",
    "gymnasium": "quad_rl/",
    "pettingzoo": "quad_rl/",
    "nicegui": "quad_web/",
    "fastapi": "quad_web/",
    "starlette": "quad_web/",
    "uvicorn": "quad_web/",
    "pymavlink": "quad_vehicles/mavlink_link.py",
    "cflib": "quad_vehicles/crazyflie_link.py",
    "PIL": ("quad_nav/sim/map_image.py", "quad_nav/report/", "quad_bench/circle/picture.py"),
}
TESTS = SOURCES.parent / "test"
ENVIRONMENT = {**os.environ, "PYTHONPATH": os.pathsep.join([str(SOURCES), *sys.path])}
MESSAGE_SUFFIXES = ("_msgs", "_srvs")


def test_every_unit_has_a_layer():
    units = {unit_of(path) for path in modules() if package_of(path)[0] == CORE}
    assert units <= set().union(*LAYERS), "name the new unit in LAYERS"


def test_every_package_is_the_core_or_an_add_on():
    assert {path.parent.name for path in SOURCES.glob("*/__init__.py")} <= {CORE, *ADD_ONS}


@pytest.mark.parametrize(
    ("node", "unloaded"),
    [
        ("quad_nav.ros.sequencer.node", "pybullet"),
        ("quad_web.ros.node", "pybullet"),
        ("quad_vehicles.ros.fleet", "pybullet"),
        ("quad_vehicles.ros.node", "numba"),
    ],
)
def test_nodes_do_not_load_engine_or_kernels_that_they_do_not_need(node, unloaded):
    pytest.importorskip("quad.msg", reason="needs ROS and `make workspace`")
    pytest.importorskip(node.partition(".")[0])
    script = f"import sys, {node}; assert not {{'pybullet', {unloaded!r}}} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", script], check=True, env=ENVIRONMENT)


PRIVATE_IN_ROSPY = re.compile(
    r"\._connection_header|\._buff\b|\.impl\b|\brospy(\.\w+)*\._\w|from rospy\S* import .*\b_\w"
)


def test_one_file_touches_what_is_private_in_rospy():
    files = [
        *modules(),
        *(SOURCES.parent / "nodes").iterdir(),
        *(SOURCES.parent / "bench").glob("*.py"),
    ]
    users = [path.name for path in files if PRIVATE_IN_ROSPY.search(path.read_text())]
    assert users == ["rospy_repairs.py"]


@pytest.mark.parametrize("path", [*SOURCES.rglob("*.py")], ids=lambda path: path.name)
def test_module_imports_only_what_it_may(path):
    assert forbidden_imports(path, imported_names(path.read_text(), package_of(path))) == []


@pytest.mark.parametrize(
    "module, statement",
    [
        ("quad_nav/costmap/layered.py", "import quad_nav.navigator.navigator"),
        ("quad_nav/cli/fly.py", "from quad_web.server import Server"),
        ("quad_tune/tune.py", "import quad_bench.barn"),
        ("quad_nav/costmap/layered.py", "from quad_nav import plan"),
        ("quad_nav/costmap/layered.py", "from ..sim.scene import Scene"),
        ("quad_nav/navigator/navigator.py", "def tick():\n    from quad_nav.sim import scene"),
        ("quad_nav/offline/run.py", "from quad_nav.ros import topics"),
        ("quad_nav/costmap/raytrace.py", "from quad_nav.control.sample_motion import longest"),
        ("quad_nav/navigator/navigator.py", "import rospy"),
        ("quad_nav/mission/summary.py", "from geometry_msgs.msg import Pose"),
        ("quad_nav/sim/lidar.py", "import pybullet as p"),
        ("quad_nav/plan/wavefront_kernel.py", "from numba import njit"),
        ("quad_nav/navigator/navigator.py", "from quad_moving import Tracker"),
    ],
)
def test_rules_refuse(module, statement):
    path = SOURCES / module
    assert len(forbidden_imports(path, imported_names(statement, package_of(path)))) == 1


@pytest.mark.parametrize(
    "module, statement",
    [
        (
            "quad_nav/costmap/layered.py",
            "from . import static\nfrom quad_nav import footprint, grid",
        ),
        ("quad_nav/navigator/navigator.py", "import numpy\nfrom quad_nav.plan.navfn import Navfn"),
        ("quad_nav/ros/navigator/nodes.py", "import rospy\nfrom nav_msgs.msg import Path"),
        ("quad_nav/sim/body.py", "import pybullet"),
        ("quad_nav/files/kernel_cache.py", "import numba"),
    ],
)
def test_rules_allow(module, statement):
    path = SOURCES / module
    assert forbidden_imports(path, imported_names(statement, package_of(path))) == []


def test_tests_of_a_package_need_no_add_on_but_their_own():
    homes = {path.stem: folder_of(path) for path in TESTS.rglob("*.py")}
    found = []
    for path in [*TESTS.glob("quad_*/**/*.py"), *TESTS.glob("helpers/*.py")]:
        for name in imported_names(path.read_text(), []):
            first = name.partition(".")[0]
            owner, user = homes.get(first, first), path.relative_to(TESTS).as_posix()
            own_or_core = owner == folder_of(path) or owner not in ADD_ONS
            if not own_or_core and (user, owner) not in BETWEEN_ADD_ONS:
                found.append(f"{user}: {name}")
    assert found == []


def folder_of(path: Path) -> str:
    return path.relative_to(TESTS).parts[0]


def test_no_module_imports_itself_through_others():
    assert import_circles(module_imports()) == []


def test_circles_are_found():
    assert import_circles({"a": {"b"}, "b": {"c", "d"}, "c": {"b"}, "d": set()}) == [{"b", "c"}]


def module_imports() -> Dict[str, Set[str]]:
    """Module -> the modules that it imports anywhere, packages' own ``__init__`` apart."""
    names = {dotted_name(path): path for path in modules() if path.stem != "__init__"}
    return {
        name: {
            part
            for imported in imported_names(path.read_text(), package_of(path))
            for part in (imported, imported.rpartition(".")[0])
            if part in names and part != name
        }
        for name, path in names.items()
    }


def dotted_name(path: Path) -> str:
    return ".".join(path.relative_to(SOURCES).with_suffix("").parts)


def import_circles(imports: Dict[str, Set[str]]) -> List[Set[str]]:
    """Sets of modules that all reach each other."""
    reached = {name: set(imported) for name, imported in imports.items()}
    changed = True
    while changed:
        changed = False
        for found in reached.values():
            more = set().union(*(reached[name] for name in found)) - found
            found |= more
            changed = changed or bool(more)
    circles: List[Set[str]] = []
    for name, found in reached.items():
        circle = {other for other in found if name in reached[other]}
        if name in found and circle not in circles:
            circles.append(circle)
    return circles


def modules() -> Iterator[Path]:
    return SOURCES.rglob("*.py")


def unit_of(path: Path) -> str:
    """`costmap` for quad_nav/costmap/layered.py, `grid` for quad_nav/grid.py."""
    return path.relative_to(SOURCES / CORE).with_suffix("").parts[0]


def forbidden_imports(path: Path, names: Set[str]) -> List[str]:
    return sorted(name for name in names if not may_import(path, name))


def may_import(path: Path, name: str) -> bool:
    first, *rest = name.split(".")
    module, package = path.relative_to(SOURCES).as_posix(), package_of(path)[0]
    if first == CORE:
        return package != CORE or not rest or may_import_unit(unit_of(path), rest[0])
    if first in ADD_ONS:
        return package == first or (module, first) in BETWEEN_ADD_ONS
    place = ROS if first.endswith(MESSAGE_SUFFIXES) else PLACES.get(first, "")
    return module.startswith(place)


def may_import_unit(importer: str, imported: str) -> bool:
    if importer == imported:
        return True
    if imported == "sim" and importer not in WORLD_USERS:
        return False
    return layer(imported) < layer(importer)


def layer(unit: str) -> int:
    rows = [row for row, units in enumerate(LAYERS) if unit in units]
    assert rows, f"name the unit {unit} in LAYERS"
    return rows[0]
