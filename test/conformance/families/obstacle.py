"""Scans and clouds to master grids, cell for cell."""

from __future__ import annotations

from pathlib import Path
from typing import Any, List, Tuple

from families.case import Case, InvalidValue, load_case
from families.comparison import Comparison, Difference
from quad_nav.config import load
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.obstacle import ObstacleLayer
from quad_nav.geometry import Pose2D, Pose3D, Scan

_METRES = 1e-12  # tolerance of footprints; grids are exact


def check(path: Path) -> List[Difference]:
    replay = Replay(load_case(path))
    replay.check_parameters()
    replay.run()
    return replay.comparison.differences


class Replay:
    """A costmap driven by a recorded list of events, compared after each of them."""

    def __init__(self, case: Case):
        self.recorded, self.meta = case.arrays, case.meta
        self.comparison = Comparison()
        self.costmap = LayeredCostmap(load({"local_costmap": self.meta["params"]}).local_costmap)
        (self.obstacles,) = [
            layer for layer in self.costmap.layers.values() if isinstance(layer, ObstacleLayer)
        ]
        self.sources = list(self.obstacles.buffers)

    def check_parameters(self) -> None:
        exact, near = self.comparison.exact, self.comparison.near
        costmap, effective = self.costmap, self.meta["effective"]
        near("footprint", costmap.footprint, self.recorded["footprint"], _METRES)
        near("inscribed_radius", costmap.inscribed_radius_m, effective["inscribed_radius"], _METRES)
        near(
            "circumscribed_radius",
            costmap.circumscribed_radius_m,
            effective["circumscribed_radius"],
            _METRES,
        )
        exact("size_x", costmap.spec.size_x, effective["size_x"])
        exact("size_y", costmap.spec.size_y, effective["size_y"])
        exact("layers", list(costmap.layers), effective["layers"])
        exact(
            "default_value", self.obstacles.grid.default_cost, effective["layer"]["default_value"]
        )

    def run(self) -> None:
        events = {
            "scan": self.scan,
            "cloud": self.cloud,
            "update": self.update,
            "reset_layers": self.reset_layers,
        }
        if not any(event["type"] == "update" for event in self.meta["events"]):
            raise InvalidValue("there is no 'update' among the events")
        for event in self.meta["events"]:
            if event["type"] not in events:
                raise InvalidValue(f"{event['type']!r} is no type of event")
            events[event["type"]](event)

    def scan(self, event: Any) -> None:
        scan = Scan(
            event["stamp"],
            event["angle_min"],
            event["angle_increment"],
            event["range_min"],
            event["range_max"],
            self.recorded[f"ranges_{event['index']:03d}"],
        )
        self.obstacles.add_scan(self.sources[event["source"]], scan, *self.poses(event))
        self.check_observation(event)

    def cloud(self, event: Any) -> None:
        points_pose, now_s, origin = self.poses(event)
        self.obstacles.add_cloud(
            self.sources[event["source"]],
            self.recorded[f"cloud_in_{event['index']:03d}"],
            points_pose,
            event["stamp"],
            now_s,
            origin,
        )
        self.check_observation(event)

    def poses(self, event: Any) -> Tuple[Pose3D, float, Pose3D]:
        x, y, z, qx, qy, qz, qw = event["sensor_in_map"]
        origin = Pose3D(*self.recorded[f"obs_origin_{event['index']:03d}"].tolist())
        return Pose3D(x, y, z, (qx, qy, qz, qw)), event["now"], origin

    def check_observation(self, event: Any) -> None:
        buffer = self.obstacles.buffers[self.sources[event["source"]]]
        number = f"{event['index']:03d}"
        self.comparison.exact(
            f"n_observations_after of event {number}",
            len(buffer.observations),
            event["n_observations_after"],
        )
        self.comparison.exact(
            f"obs_cloud_{number}",
            buffer.observations[0].points,
            self.recorded[f"obs_cloud_{number}"],
        )

    def reset_layers(self, event: Any) -> None:
        self.costmap.reset_layers(event["now"])

    def update(self, event: Any) -> None:
        k, recorded, exact = event["index"], self.recorded, self.comparison.exact
        window = self.costmap.update(event["now"], Pose2D(*recorded["robot_pose"][k].tolist()))
        spec = self.costmap.spec
        exact(f"origin[{k}]", [spec.origin_x_m, spec.origin_y_m], recorded["origin"][k])
        exact(f"bounds[{k}]", [window.x0, window.xn, window.y0, window.yn], recorded["bounds"][k])
        exact(
            f"n_observations[{k}]",
            [len(buffer.observations) for buffer in self.obstacles.buffers.values()],
            event["n_observations"],
        )
        exact(f"layer[{k}]", self.obstacles.grid.costs, recorded["layer"][k])
        exact(f"master[{k}]", self.costmap.costs, recorded["master"][k])
        exact(f"current[{k}]", self.costmap.is_current(event["now"]), bool(recorded["current"][k]))
