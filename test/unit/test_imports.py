"""Imports go one way: from the shells to the core, and each third party has its one place."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Dict, Iterator, List, Set

import pytest

SOURCES = Path(__file__).resolve().parents[2] / "src"
PACKAGE = "quad_nav"

# A unit (a module or a package directly in quad_nav) imports itself and units of the rows above.
LAYERS = [
    {"errors"},
    {"versions"},
    {"__init__"},  # quad_nav.__version__
    {"geometry", "grid", "files"},
    {"footprint", "timing", "results"},
    {"kernels"},
    {"costmap", "plan", "control", "sim"},
    {"recovery", "peers"},
    {"navigator", "mission", "vehicle"},
    {"config"},
    {"scenario"},
    {"loop", "topics"},
    {"view"},
    {"web"},
    {"offline", "ros"},
    {"recording", "api"},
    {"report"},
    {"barn", "circle"},
    {"tuning"},
    {"cli", "rl"},
]
# Navigation and the simulator do not import each other.
WORLD_USERS = {
    "sim",
    "mission",
    "scenario",
    "topics",
    "loop",
    "view",
    "web",
    "offline",
    "recording",
    "report",
    "barn",
    "circle",
    "tuning",
    "cli",
    "ros",
    "api",
    "rl",
}

# The files or folders in which a third-party package may be imported.
PLACES = {
    "click": "cli/",
    "rich": "cli/",
    "joblib": "offline/workers.py",
    "ray": "offline/workers.py",
    "pyrvo": "circle/orca.py",
    "optuna": "tuning/",
    "sqlalchemy": "tuning/study.py",
    "numba": "kernels/",
    "llvmlite": "kernels/",
    "pybullet": "sim/body.py",
    "defusedxml": "files/xml_tree.py",
    "rospy": "ros/",
    "rosgraph": "ros/",
    "actionlib": "ros/",
    "dynamic_reconfigure": "ros/",
    "tf2_ros": "ros/",
    "rerun": "recording/viewer",
    "lz4": "recording/",
    "rosbags": "recording/",
    "mcap": "recording/",
    "matplotlib": ("report/", "tuning/report/"),
    "jinja2": "report/",
    "plotly": "report/",
    "pandas": "api/",
    "gymnasium": "rl/",
    "pettingzoo": "rl/",
    "nicegui": "web/",
    "fastapi": "web/",
    "starlette": "web/",
    "uvicorn": "web/",
    "pymavlink": "vehicle/mavlink_link.py",
    "cflib": "vehicle/crazyflie_link.py",
    "PIL": ("sim/map_image.py", "report/"),
}
MESSAGE_SUFFIXES = ("_msgs", "_srvs")
ADD_ONS = {path.name for path in SOURCES.glob("quad_*")} - {PACKAGE}


def test_every_unit_has_a_layer():
    units = {unit_of(path) for path in modules()}
    assert units <= set().union(*LAYERS), "name the new unit in LAYERS"


@pytest.mark.parametrize("path", [*(SOURCES / PACKAGE).rglob("*.py")], ids=lambda path: path.name)
def test_module_imports_only_what_it_may(path):
    assert forbidden_imports(path, imported_names(path.read_text(), package_of(path))) == []


@pytest.mark.parametrize(
    "module, statement",
    [
        ("costmap/layered.py", "import quad_nav.navigator.navigator"),
        ("costmap/layered.py", "from quad_nav import plan"),
        ("costmap/layered.py", "from ..sim.scene import Scene"),
        ("navigator/navigator.py", "def tick():\n    from quad_nav.sim import scene"),
        ("offline/run.py", "from quad_nav.ros import topics"),
        ("kernels/wave.py", "from quad_nav.costmap.layered import LayeredCostmap"),
        ("navigator/navigator.py", "import rospy"),
        ("mission/summary.py", "from geometry_msgs.msg import Pose"),
        ("sim/lidar.py", "import pybullet as p"),
        ("plan/navfn.py", "from numba import njit"),
        ("navigator/navigator.py", "from quad_moving import Tracker"),
    ],
)
def test_rules_refuse(module, statement):
    path = SOURCES / PACKAGE / module
    assert len(forbidden_imports(path, imported_names(statement, package_of(path)))) == 1


@pytest.mark.parametrize(
    "module, statement",
    [
        ("costmap/layered.py", "from . import static\nfrom quad_nav import footprint, grid"),
        ("navigator/navigator.py", "import numpy\nfrom quad_nav.plan.navfn import Navfn"),
        ("ros/navigator/nodes.py", "import rospy\nfrom nav_msgs.msg import Path"),
        ("sim/body.py", "import pybullet"),
        ("kernels/wave.py", "from numba import njit"),
    ],
)
def test_rules_allow(module, statement):
    path = SOURCES / PACKAGE / module
    assert forbidden_imports(path, imported_names(statement, package_of(path))) == []


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
    return (SOURCES / PACKAGE).rglob("*.py")


def unit_of(path: Path) -> str:
    """`costmap` for quad_nav/costmap/layered.py, `grid` for quad_nav/grid.py."""
    return path.relative_to(SOURCES / PACKAGE).with_suffix("").parts[0]


def package_of(path: Path) -> List[str]:
    """The dotted parts of the package that the module's relative imports start from."""
    return list(path.relative_to(SOURCES).parent.parts)


def imported_names(source: str, package: List[str]) -> Set[str]:
    """The dotted names that the source imports anywhere, `from a import b` as `a.b`."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            parts = [*base, *(node.module or "").split(".")] if node.module else base
            names.update(".".join([*parts, alias.name]) for alias in node.names)
    return names


def forbidden_imports(path: Path, names: Set[str]) -> List[str]:
    return sorted(name for name in names if not may_import(path, name))


def may_import(path: Path, name: str) -> bool:
    first, *rest = name.split(".")
    if first == PACKAGE:
        return not rest or may_import_unit(unit_of(path), rest[0])
    if first in ADD_ONS:
        return False
    place = "ros/" if first.endswith(MESSAGE_SUFFIXES) else PLACES.get(first, "")
    return path.relative_to(SOURCES / PACKAGE).as_posix().startswith(place)


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
