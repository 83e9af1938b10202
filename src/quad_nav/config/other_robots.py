"""Fit the configuration of another robot to a simulated quadcopter.

A quadcopter has the frames ``map``, ``odom{i}``, ``base_link{i}`` and ``Lidar{i}``, one LIDAR on
``/scan{i}``, and no other sensor. A configuration with another ``robot_base_frame`` was made for
another robot: its frames and topics are mapped, sensors that a quadcopter has not got are left
out, and each kind of change is one remark. A configuration made for quadcopters stays as it is.
"""

from __future__ import annotations

import copy
import re
from typing import Any, Dict, Iterator, List, Mapping, Optional, Tuple

from quad_nav.config.files import COSTMAPS, ParameterTree, set_value
from quad_nav.config.layers import LAYERS
from quad_nav.config.notes import CAUTION, LEFT_OUT, MAPPED, Remark
from quad_nav.config.other_planners import footprint_of
from quad_nav.config.plugins import is_dotted, plugin_name
from quad_nav.costmap.layered import CostmapParams
from quad_nav.costmap.observation import SourceParams
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.files.number_texts import polygon_from_list, polygon_from_text
from quad_nav.footprint import radii
from quad_nav.navigator.params import DEFAULT_GLOBAL_PLANNER, DEFAULT_LOCAL_PLANNER

_OWN_NAME = re.compile(r"/*(?:odom|base_link|Lidar|scan)(\d+)")
_OWN_TOPICS = ("scan", "/scan")  # move_base{i} has a remap from /scan to /scan{i}
_CLOUDS = ("PointCloud", "PointCloud2")
_DWA = "dwa_local_planner/DWAPlannerROS"
_PLANNERS = {
    "base_local_planner": (
        DEFAULT_LOCAL_PLANNER,
        (
            _DWA,
            "teb_local_planner/TebLocalPlannerROS",
            "eband_local_planner/EBandPlannerROS",
            "mpc_local_planner/MpcLocalPlannerROS",
        ),
    ),
    "base_global_planner": (DEFAULT_GLOBAL_PLANNER, ("global_planner/GlobalPlanner",)),
}
# Heights of points that the LIDAR marks: above the floor that a tilted LIDAR sees, and as high as
# the voxels of costmap_2d reach by default. Quadcopters fly between them.
_LOWEST_M, _HIGHEST_M = 0.3, 2.0
_SMALLEST_BODY_M = 0.05
_VOXELS = 10
# (kind of change, place, kind of remark, text with the changes) in the order of the remarks.
_REMARKS = (
    (
        "slashes",
        "frames",
        CAUTION,
        "{}: tf2 refuses the leading slash, move_base in C++ does not run with it",
    ),
    ("frames", "frames", MAPPED, "{}"),
    ("topics", "topics", MAPPED, "{}"),
    ("layers", "layers", MAPPED, "{}"),
    ("stand-ins", "sensors", MAPPED, "the LIDAR stands in for {}"),
    ("sensors", "sensors", LEFT_OUT, "{}: left out, a quadcopter has none"),
    ("lasers", "sensors", LEFT_OUT, "{}: left out, the one LIDAR sees all around"),
    ("heights", "heights", MAPPED, "{}: raised to the LIDAR of a flying robot"),
)


def adapted(tree: ParameterTree, number: int) -> ParameterTree:
    """Adapt the parameters of another robot to quadcopter ``number``.

    Returns:
        A copy with the changes, and a remark for each kind of change.
    """
    fit = _Fit(copy.deepcopy(tree), number)
    fit.run()
    return fit.tree


def input_faults(costmaps: Mapping[str, CostmapParams], number: int) -> Iterator[Tuple[str, str]]:
    """Yield (path, problem) of each frame and sensor that the simulation does not have.

    Under ROS another node may publish them.
    """
    yield from sensor_faults(costmaps)
    known = {"global_frame": ("map", f"odom{number}"), "robot_base_frame": (f"base_link{number}",)}
    lidar = f"Lidar{number}"
    for costmap in costmaps.values():
        for key, names in known.items():
            if getattr(costmap, key).lstrip("/") not in names:
                yield key, f"{getattr(costmap, key)}; expected {' or '.join(names)}"
        for layer, source in _sources(costmap):
            if source.sensor_frame.lstrip("/") not in ("", lidar):
                problem = f"sensor_frame {source.sensor_frame}; expected {lidar} or none"
                yield f"{layer}/{source.name}", problem


def sensor_faults(costmaps: Mapping[str, CostmapParams]) -> Iterator[Tuple[str, str]]:
    """Yield (path, problem) of each source of an obstacle layer that is not a LaserScan."""
    for costmap in costmaps.values():
        for layer, source in _sources(costmap):
            if source.data_type != "LaserScan":
                expected = "expected LaserScan, the only sensor of the simulated robots"
                yield f"{layer}/{source.name}", f"data_type {source.data_type}; {expected}"


def _sources(costmap: CostmapParams) -> Iterator[Tuple[str, SourceParams]]:
    """Yield the obstacle layers' sources, with the layers' names."""
    for name, layer in costmap.layers:
        for source in layer.sources if isinstance(layer, ObstacleLayerParams) else ():
            yield name, source


class _Fit:
    """One fit: the tree, and what was changed of each kind."""

    def __init__(self, tree: ParameterTree, number: int) -> None:
        self.tree = tree
        self._number = number
        # Kind of change -> what was changed, each once in the order of the files.
        self._found: Dict[str, Dict[str, None]] = {}

    def _note(self, kind: str, change: str) -> None:
        self._found.setdefault(kind, {})[change] = None

    def run(self) -> None:
        """Change the tree and add the remarks."""
        self._choose_planners()
        self._take_footprint()
        for name in COSTMAPS:
            costmap = self._costmap(name)
            self._map_frames(costmap)
            self._replace_layers(costmap)
            self._map_sources(costmap, name)
            for namespace in (costmap, *_below(costmap)):
                self._map_map_topic(namespace)
                self._raise_heights(namespace)
        self._map_odometry()
        body = self._body()
        self._add_remarks(body)

    def _choose_planners(self) -> None:
        """Choose the planners that the YAML has parameters for: launch files name them beside it.

        Of both local planners, files have parameters for DWAPlannerROS because it is flown; those
        for TrajectoryPlannerROS, which is upstream's default, are older ones.
        """
        for key, (default, others) in _PLANNERS.items():
            found = [name for name in others if isinstance(self.tree.get(plugin_name(name)), dict)]
            if key in self.tree or len(found) != 1:
                continue
            text = f"{found[0]}, the only one with parameters"
            if plugin_name(default) in self.tree:
                if found[0] != _DWA:
                    continue
                text = (
                    f"{_DWA}, as launch files of files with parameters for both planners; set "
                    f"{key}={default} for the other"
                )
            set_value(self.tree, key, found[0], "")
            self.tree.remarks.append(Remark(key, MAPPED, text))

    def _take_footprint(self) -> None:
        """Give the costmaps the footprint that only a local planner knows."""
        places = [self.tree, *(self._costmap(name) for name in COSTMAPS)]
        if any("footprint" in place or "robot_radius" in place for place in places):
            return
        for namespace in _below(self.tree):
            for key, value in footprint_of(namespace).items():
                set_value(self.tree, key, value, "")

    def _costmap(self, name: str) -> Dict[str, Any]:
        if self.tree.get(name) is None:
            self.tree[name] = {}
        costmap = self.tree[name]
        return costmap if isinstance(costmap, dict) else {}  # a fault that ``load`` reports

    def _map_frames(self, costmap: Dict[str, Any]) -> None:
        frame = costmap.get("global_frame", CostmapParams.global_frame)
        if isinstance(frame, str):
            own = f"odom{self._number}" if "odom" in frame.rpartition("/")[2] else "map"
            costmap["global_frame"] = self._frame(frame, own)
        frame = costmap.get("robot_base_frame", CostmapParams.robot_base_frame)
        if isinstance(frame, str):
            costmap["robot_base_frame"] = self._frame(frame, f"base_link{self._number}")

    def _frame(self, given: str, own: str) -> str:
        """Return the quadcopter's frame, or the given one if it is of another quadcopter."""
        if given.startswith("/"):
            self._note("slashes", given)
        if _OWN_NAME.fullmatch(given):
            return given
        if given.lstrip("/") != own:
            self._note("frames", f"{given} is {own.replace(str(self._number), '{i}')}")
        return own

    def _map_odometry(self) -> None:
        planner, own = _source(self.tree, plugin_name(_DWA)), f"odom{self._number}"
        topic = planner.get("odom_topic")
        if isinstance(topic, str) and topic.lstrip("/") not in ("odom", own):
            self._note("topics", f"{topic} is /odom{{i}}")
            planner["odom_topic"] = f"/{own}"

    def _map_map_topic(self, namespace: Dict[str, Any]) -> None:
        topic = namespace.get("map_topic")
        if isinstance(topic, str) and topic.lstrip("/") != "map":
            self._note("maps", f"{topic} is /map")
            namespace["map_topic"] = "/map"

    def _replace_layers(self, costmap: Dict[str, Any]) -> None:
        """Replace layers that have no like here by the obstacle layer, if they have sources."""
        plugins = costmap.get("plugins")
        for entry in plugins if isinstance(plugins, list) else ():
            if not isinstance(entry, dict):
                continue
            name, kind = entry.get("name"), entry.get("type")
            if not isinstance(name, str) or not isinstance(kind, str):
                continue
            if kind in LAYERS or is_dotted(kind):
                continue
            own = next((known for known in LAYERS if plugin_name(known) == plugin_name(kind)), "")
            below = costmap.get(name)
            if not own and isinstance(below, dict) and "observation_sources" in below:
                own = "costmap_2d::ObstacleLayer"
            if own:
                entry["type"] = own
                self._note("layers", f"{kind} is {own}")

    def _map_sources(self, costmap: Dict[str, Any], name: str) -> None:
        """Map the lasers of all layers; a costmap without one gets the LIDAR for another sensor."""
        lists = [
            namespace
            for namespace in (costmap, *_below(costmap))
            if isinstance(namespace.get("observation_sources"), str)
        ]
        clouds: List[Tuple[Dict[str, Any], str]] = []
        seen = False
        for namespace in lists:
            names = namespace["observation_sources"].split()
            clouds += [(namespace, one) for one in names if _is_cloud(namespace, one)]
            kept = self._kept(namespace, names)
            namespace["observation_sources"] = " ".join(kept)
            seen = seen or bool(kept)
        if clouds and not seen:
            namespace, stand_in = clouds.pop(0)
            namespace["observation_sources"] = stand_in
            source = namespace.setdefault(stand_in, {}) or {}
            seeing = {"data_type": "LaserScan", "marking": True, "clearing": True}
            namespace[stand_in] = {**source, **seeing}
            self._note("stand-ins", stand_in)
            self._map_source(namespace[stand_in], stand_in)
        for namespace, left in clouds:
            data_type = _source(namespace, left).get("data_type", "PointCloud")
            self._note("sensors", f"{left} ({data_type})")
            namespace.pop(left, None)

    def _kept(self, namespace: Dict[str, Any], names: List[str]) -> List[str]:
        """Return the sources of a layer that the LIDAR serves, mapped.

        A further laser is left out: the LIDAR sees all around, and has done what it does.
        """
        kept: List[str] = []
        done: set[str] = set()
        for name in names:
            if _is_cloud(namespace, name):
                continue
            source = _source(namespace, name)
            purposes = {key for key in ("marking", "clearing") if source.get(key, key == "marking")}
            if kept and purposes <= done:
                self._note("lasers", name)
                namespace.pop(name, None)
                continue
            done |= purposes
            kept.append(name)
            self._map_source(source, name)
        return kept

    def _map_source(self, source: Dict[str, Any], name: str) -> None:
        topic = source.get("topic", name)
        own = f"scan{self._number}"
        if isinstance(topic, str) and topic not in (*_OWN_TOPICS, own, f"/{own}"):
            self._note("topics", f"{topic} is /scan{{i}}")
            source["topic"] = f"/{own}"
        frame = source.get("sensor_frame", "")
        if isinstance(frame, str) and frame:
            source["sensor_frame"] = self._frame(frame, f"Lidar{self._number}")
        self._set_height(source, "min_obstacle_height", _LOWEST_M)
        if _is_below(source.get("max_obstacle_height"), _HIGHEST_M):
            self._set_height(source, "max_obstacle_height", _HIGHEST_M)

    def _set_height(self, namespace: Dict[str, Any], key: str, value: float) -> None:
        if key in namespace and namespace[key] != value:
            self._note("heights", key)
        namespace[key] = value

    def _raise_heights(self, namespace: Dict[str, Any]) -> None:
        """Make layers and their voxels as high as the LIDAR flies."""
        if _is_below(namespace.get("max_obstacle_height"), _HIGHEST_M):
            self._set_height(namespace, "max_obstacle_height", _HIGHEST_M)
        voxels = namespace.get("z_voxels", _VOXELS)
        bottom, size = namespace.get("origin_z", 0.0), namespace.get("z_resolution", 0.2)
        numbers = [one for one in (voxels, bottom, size) if isinstance(one, (int, float))]
        if len(numbers) == 3 and voxels > 0:
            if bottom > _LOWEST_M:
                self._set_height(namespace, "origin_z", 0.0)
            if bottom + voxels * size < _HIGHEST_M - 1e-6:
                size = (_HIGHEST_M - min(bottom, 0.0)) / voxels
                self._set_height(namespace, "z_resolution", size)
        if namespace.get("mark_threshold", 0) != 0:
            self._set_height(namespace, "mark_threshold", 0)

    def _body(self) -> Optional[float]:
        """Set and return the body's radius: the circle that move_base keeps free of obstacles."""
        costmap = self._costmap("local_costmap")
        if "body_radius" in self.tree:
            return None
        footprint = costmap.get("footprint", self.tree.get("footprint", []))
        try:
            convert = polygon_from_text if isinstance(footprint, str) else polygon_from_list
            polygon = convert(footprint)
        except ValueError:  # a fault that ``load`` reports
            return None
        default_m = CostmapParams.robot_radius_m
        radius_m = costmap.get("robot_radius", self.tree.get("robot_radius", default_m))
        if polygon is not None:
            radius_m = radii(polygon)[0]
        if isinstance(radius_m, bool) or not isinstance(radius_m, (int, float)):
            return None
        body_m = max(round(float(radius_m), 3), _SMALLEST_BODY_M)
        set_value(self.tree, "body_radius", body_m, "")
        return body_m

    def _add_remarks(self, body_m: Optional[float]) -> None:
        self._found["topics"] = {**self._found.get("topics", {}), **self._found.get("maps", {})}
        for kind, place, remark, text in _REMARKS:
            changes = ", ".join(self._found.get(kind, ()))
            if changes:
                self.tree.remarks.append(Remark(place, remark, text.format(changes)))
        if body_m is not None:
            text = (
                f"the simulated body is a disc of {body_m:g} m radius, which fits into the "
                "robot's footprint; set body_radius for another"
            )
            self.tree.remarks.append(Remark("body_radius", MAPPED, text))


def _below(costmap: Mapping[str, Any]) -> List[Dict[str, Any]]:
    return [value for value in costmap.values() if isinstance(value, dict)]


def _source(namespace: Dict[str, Any], name: str) -> Dict[str, Any]:
    source = namespace.get(name)
    return source if isinstance(source, dict) else {}


def _is_cloud(namespace: Dict[str, Any], name: str) -> bool:
    """True for a point cloud, which is also what a source without a type is."""
    return _source(namespace, name).get("data_type", "PointCloud") in _CLOUDS


def _is_below(value: Any, limit_m: float) -> bool:
    return isinstance(value, (int, float)) and value < limit_m
