"""Localizers of vehicles: start one if the file of the vehicles asks for it.

    run_module quad_vehicles.localizers FILE SCENE NUMBER COMMAND [ARGUMENT...]

`vehicles.launch` uses this as the `launch-prefix` of `amcl`, `slam` and `map_server`, because
roslaunch cannot read the file. NUMBER is that of the vehicle; only `amcl` uses it. A localizer that
the file does not ask for ends at once, with 0. So it does if the file has faults, which the node
`vehicles` tells.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import List, Optional, Sequence

from quad_nav.errors import InputError
from quad_vehicles.vehicle_file import AMCL, FIXED, NONE, SLAM, Vehicle, load_vehicles


def name_of(vehicle: Vehicle) -> str:
    """Return what localizes a vehicle, for people; "" if its odometry frame stands still."""
    return {FIXED: "", NONE: "any node"}.get(vehicle.localization, vehicle.localization)


def arguments(
    node: str, vehicles: Sequence[Vehicle], scene: str, number: int
) -> Optional[List[str]]:
    """Return the arguments of a localizer that follow from the file; None if it is not wanted.

    Args:
        node: Type of the node.
        vehicles: The file.
        scene: File of the room; "" if it is unknown.
        number: Number of the vehicle.
    """
    localization, map_file = vehicles[0].localization, vehicles[0].map_file
    starts = {one.number: one.map_from_start for one in vehicles if one.kind != "simulated"}
    start = starts.get(number)
    if (node, localization) == ("amcl", AMCL) and start is not None:
        values = {"x": start.x_m, "y": start.y_m, "a": start.yaw_rad}
        return [f"_initial_pose_{name}:={value!r}" for name, value in values.items()]
    if (node, localization) == ("map_server", AMCL):
        return [map_file or scene]
    if (node, localization) == ("slam", SLAM):
        return [
            f"_start{number}:=[{one.x_m!r}, {one.y_m!r}, {one.yaw_rad!r}]"
            for number, one in starts.items()
            if one is not None
        ]
    return None


def main() -> int:
    """Become the node of the command line, or end."""
    path, scene, number, command, *more = sys.argv[1:]
    try:
        vehicles = load_vehicles(path)
    except InputError:
        return 0
    found = arguments(Path(command).name, vehicles, scene, int(number))
    if found is not None:
        os.execv(command, [command, *found, *more])
    return 0


if __name__ == "__main__":
    sys.exit(main())
