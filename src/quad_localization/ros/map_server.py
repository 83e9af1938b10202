"""Node `map_server`: publish a map, or the map of a scene.

Topics, services and the parameter `~frame_id` are those of map_server. For `random` the scene is
that of a random mission with the parameters `~robots`, `~seed` and `~size`, as in the simulator.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import List, Tuple

import rospy
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import (
    GetMap,
    GetMapRequest,
    GetMapResponse,
    LoadMap,
    LoadMapRequest,
    LoadMapResponse,
)

from quad_localization.map_files import CELL_M, read_map
from quad_nav.errors import InputError
from quad_nav.files.values import is_number, value_faults
from quad_nav.ros.common.nav_messages import map_message
from quad_nav.ros.common.readiness import init_node
from quad_nav.scenario import RANDOM
from quad_nav.scenario.rules import RULES
from quad_nav.scenario.scenario import scene_of
from quad_nav.scenario.scene_map import scene_map
from quad_nav.sim.scene import Scene

EXIT_BAD_INPUT = 2
_USAGE = "expected map_server FILE [RESOLUTION]: a map's file, a scene, a world or random"


class MapServer:
    """Publishers and services of the node."""

    def __init__(self, path: Path, resolution_m: float, frame: str) -> None:
        """Read the map and advertise it.

        Raises:
            InputError: Every fault of the file.
        """
        self._resolution_m, self._frame = resolution_m, frame
        self._message = self._read(path)
        self._grid = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
        self._metadata = rospy.Publisher("map_metadata", MapMetaData, queue_size=1, latch=True)
        self._publish()
        rospy.Service("static_map", GetMap, self._answer)
        rospy.Service("change_map", LoadMap, self._change)

    def _read(self, path: Path) -> OccupancyGrid:
        if str(path) == RANDOM:
            found = scene_map(_random_scene(), self._resolution_m)
        else:
            found = read_map(path, self._resolution_m)
        return map_message(replace(found, frame=self._frame), rospy.Time.now())

    def _publish(self) -> None:
        self._grid.publish(self._message)
        self._metadata.publish(self._message.info)

    def _answer(self, _request: GetMapRequest) -> GetMapResponse:
        return GetMapResponse(self._message)

    def _change(self, request: LoadMapRequest) -> LoadMapResponse:
        path = Path(request.map_url)
        try:
            self._message = self._read(path)
        except InputError as error:
            rospy.logerr("map_server: %s", error)
            found = path.is_file()
            code = "RESULT_INVALID_MAP_DATA" if found else "RESULT_MAP_DOES_NOT_EXIST"
            return LoadMapResponse(result=getattr(LoadMapResponse, code))
        self._publish()
        return LoadMapResponse(self._message, LoadMapResponse.RESULT_SUCCESS)


def _random_scene() -> Scene:
    """Return the scene of the random mission of the node's parameters.

    Raises:
        InputError: A parameter is not valid, or the arena has no room.
    """
    rules = {name: RULES[name] for name in ("robots", "seed", "size")}
    values = {"robots": 2, "seed": 0, "size": 0.0}
    values = {name: rospy.get_param(f"~{name}", value) for name, value in values.items()}
    faults = value_faults(values, rules, "map_server")
    if faults:
        raise InputError(faults)
    return scene_of({"scene": RANDOM, **values})


def main() -> int:
    """Run the node; return 0, or 2 if the file or the arguments are not valid."""
    init_node("map_server")
    arguments = rospy.myargv(sys.argv)[1:]
    frame = rospy.get_param("~frame_id", "map")
    try:
        node = MapServer(*_arguments(arguments), frame)
    except InputError as error:
        rospy.logfatal("map_server: %s", error)
        return EXIT_BAD_INPUT
    while not rospy.is_shutdown():
        time.sleep(0.2)
    del node
    return 0


def _arguments(given: List[str]) -> Tuple[Path, float]:
    resolution = given[1] if len(given) == 2 else str(CELL_M)
    try:
        resolution_m = float(resolution)
    except ValueError:
        resolution_m = 0.0
    if not 1 <= len(given) <= 2 or not is_number(resolution_m) or resolution_m <= 0.0:
        raise InputError([f"arguments: {' '.join(given)}; {_USAGE}"])
    return Path(given[0]), resolution_m
