"""One costmap driven by recorded events, and compared with what the original had.

``Player`` knows the events of ``obstacle``, ``static`` and ``voxel``. A family with more
of them, or with two costmaps, derives from it or plays two:

    player = Player(case, comparison, configuration, name="local_costmap", prefix="local_")
    player.check_parameters(effective, footprint)
    player.take_first_maps(events)
    for event in events:
        player.play(event)
    player.check_grids("recovery_", 0)
"""

from __future__ import annotations

from itertools import takewhile
from typing import Any, Callable, Dict, List, Sequence, Tuple

import numpy as np
from upstream import UPSTREAM

from families.case import Case, InvalidValue
from families.comparison import Comparison
from families.frames import Frames
from quad_nav.config import Configuration, load, updated
from quad_nav.costmap.layer import GridLayer
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.obstacle import ObstacleLayer
from quad_nav.costmap.static import StaticLayer, StaticMap
from quad_nav.costmap.voxel import VoxelLayer
from quad_nav.geometry import Pose2D, Pose3D, Scan
from quad_nav.grid import FREE, LETHAL, GridSpec

_METRES = 1e-12  # tolerance of footprints; grids are exact
_BITS = 16  # of one half of a column of voxels


def load_upstream(**costmaps: Any) -> Configuration:
    """The configuration with these costmaps and every fix off."""
    return load({**_as_set(costmaps), **UPSTREAM})


def _as_set(values: Any) -> Any:
    """Parameters as a user sets them: 2 is what the original makes of combination_method 99."""
    if not isinstance(values, dict):
        return values
    changed = {name: _as_set(value) for name, value in values.items()}
    if changed.get("combination_method") == 2:
        changed["combination_method"] = 99
    return changed


class Player:
    """A costmap that plays events.

    ``costmap`` and ``frames`` may be used by others between the events.
    """

    def __init__(
        self,
        case: Case,
        comparison: Comparison,
        configuration: Configuration,
        name: str = "local_costmap",
        prefix: str = "",
    ):
        """Make the costmap ``name`` of a configuration, with arrays that begin with ``prefix``."""
        self.recorded, self.comparison = case.arrays, comparison
        self.configuration, self.name, self.prefix = configuration, name, prefix
        self.costmap = LayeredCostmap(getattr(configuration, name))
        self.frames = Frames()
        self.first_maps: List[Any] = []
        self.events: Dict[str, Callable[[Any], None]] = {
            "scan": self.scan,
            "cloud": self.cloud,
            "map": self.map,
            "map_update": self.map_update,
            "transform": self.transform,
            "enable": self.enable,
            "reconfigure": self.reconfigure,
            "update": self.update,
            "reset_layers": self.reset_layers,
        }

    # -- layers ----------------------------------------------------------------------------

    @property
    def obstacle_layers(self) -> List[ObstacleLayer]:
        return [one for one in self.costmap.layers.values() if isinstance(one, ObstacleLayer)]

    def obstacle_layer(self, event: Any) -> ObstacleLayer:
        """The layer that an event names; the only one when it names none."""
        if "layer" not in event:
            return self.obstacle_layers[0]
        layer = self._layer(event["layer"])
        if not isinstance(layer, ObstacleLayer):
            raise InvalidValue(f"{event['layer']!r} takes no clouds")
        return layer

    def _layer(self, name: str) -> Any:
        if name not in self.costmap.layers:
            raise InvalidValue(f"there is no layer {name!r}")
        return self.costmap.layers[name]

    def _static_layers(self) -> List[Tuple[str, StaticLayer]]:
        layers = self.costmap.layers.items()
        return [(name, layer) for name, layer in layers if isinstance(layer, StaticLayer)]

    # -- before the first update -----------------------------------------------------------

    def take_first_maps(self, events: Sequence[Any]) -> None:
        """Set the maps that were there when the costmap was constructed.

        Each layer in turn waited for its first one, the last on its latched topic; so the
        order of the layers counts, not that of the events.
        """
        before = takewhile(lambda event: event["type"] in ("map", "transform"), events)
        self.first_maps = [event for event in before if event["type"] == "map"]
        maps = {_global_name(event["topic"]): self._map_of(event) for event in self.first_maps}
        for name, layer in self._static_layers():
            topic = _global_name(layer.params.map_topic)
            if topic in maps:
                self.costmap.set_map(maps[topic], name)

    def check_parameters(self, effective: Any) -> None:
        """Compare with ``meta.effective``, after the first maps."""
        exact, near = self.comparison.exact, self.comparison.near
        costmap, spec = self.costmap, self.costmap.spec
        near("footprint", costmap.footprint, self.recorded["footprint"], _METRES)
        near("inscribed_radius", costmap.inscribed_radius_m, effective["inscribed_radius"], _METRES)
        near(
            "circumscribed_radius",
            costmap.circumscribed_radius_m,
            effective["circumscribed_radius"],
            _METRES,
        )
        exact("size", [spec.size_x, spec.size_y], [effective["size_x"], effective["size_y"]])
        exact("resolution", spec.resolution_m, effective["resolution"])
        if "origin" in effective:
            exact("origin", [spec.origin_x_m, spec.origin_y_m], effective["origin"])
        if "layers" in effective:
            exact("layers", list(costmap.layers), effective["layers"])
        if "layer" in effective:
            (layer,) = self.obstacle_layers
            exact("default", layer.grid.default_cost, effective["layer"]["default_value"])
        for name, default in effective.get("layer_defaults", {}).items():
            exact(f"default of {name}", self._layer(name).grid.default_cost, default)

    # -- events ----------------------------------------------------------------------------

    def play(self, event: Any) -> None:
        """Play an event.

        Raises:
            InvalidValue: no event of that type.
        """
        if event["type"] not in self.events:
            raise InvalidValue(f"{event['type']!r} is no type of event")
        self.events[event["type"]](event)

    def scan(self, event: Any) -> None:
        scan = Scan(
            event["stamp"],
            event["angle_min"],
            event["angle_increment"],
            event["range_min"],
            event["range_max"],
            self.recorded[f"ranges_{event['index']:03d}"],
        )
        layer = self.obstacle_layer(event)
        layer.add_scan(self._source(layer, event), scan, *self._poses(event))
        self._check_observation(layer, event)

    def cloud(self, event: Any) -> None:
        points_pose, now_s, origin = self._poses(event)
        layer = self.obstacle_layer(event)
        layer.add_cloud(
            self._source(layer, event),
            self.recorded[f"cloud_in_{event['index']:03d}"],
            points_pose,
            event["stamp"],
            now_s,
            origin,
        )
        self._check_observation(layer, event)

    def map(self, event: Any) -> None:
        if event in self.first_maps:
            return
        static_map = self._map_of(event)
        for name, layer in self._static_layers():
            if _global_name(layer.params.map_topic) == _global_name(event["topic"]):
                self.costmap.set_map(static_map, name)

    def map_update(self, event: Any) -> None:
        occupancy = self.recorded[f"map_update_{event['index']:03d}"]
        for _, layer in self._static_layers():
            listens = _global_name(layer.params.map_topic) == _global_name(event["topic"])
            if listens and layer.params.subscribe_to_updates:
                layer.update_map(occupancy, event["x"], event["y"])

    def transform(self, event: Any) -> None:
        self.frames.set_transform(event["parent"], event["child"], _pose_of(event["pose"]))

    def enable(self, event: Any) -> None:
        self._reconfigure_layer(event["layer"], {"enabled": event["enabled"]})

    def reconfigure(self, event: Any) -> None:
        self._reconfigure_layer(event["layer"], event["values"])
        self._check_current_after(event)

    def reset_layers(self, event: Any) -> None:
        self.costmap.reset_layers(event["now"])
        self._check_current_after(event)

    def update(self, event: Any) -> None:
        self.costmap.set_map_poses(
            {
                frame: self.frames.lookup(frame, self.costmap.params.global_frame)
                for frame in self.costmap.map_frames
            }
        )
        k, now_s = event["index"], event["now"]
        robot = Pose2D(*self.recorded[f"{self.prefix}robot_pose"][k].tolist())
        window = self.costmap.update(now_s, robot)
        self.comparison.exact(
            f"{self.prefix}n_observations[{k}]",
            [
                len(buffer.observations)
                for layer in self.obstacle_layers
                for buffer in layer.buffers.values()
            ],
            event["n_observations"],
        )
        self.check_bounds("", k, [window.x0, window.xn, window.y0, window.yn])
        self.check_grids("", k)
        self.check_current("", k, now_s)

    # -- comparisons -----------------------------------------------------------------------

    def check_bounds(self, middle: str, k: int, found: Sequence[int]) -> None:
        """Compare (x0, xn, y0, yn) with row ``k`` of ``<prefix><middle>bounds``."""
        name = f"{self.prefix}{middle}bounds"
        self.comparison.exact(f"{name}[{k}]", found, self.recorded[name][k])

    def check_current(self, middle: str, k: int, now_s: float) -> None:
        """Compare isCurrent() with row ``k`` of ``<prefix><middle>current``."""
        name = f"{self.prefix}{middle}current"
        current = bool(self.recorded[name][k])
        self.comparison.exact(f"{name}[{k}]", self.costmap.is_current(now_s), current)

    def check_grids(self, middle: str, k: int) -> None:
        """Compare every recorded grid, its place, and voxels with those of number ``k``.

        The arrays begin with ``<prefix><middle>``.
        """
        begin = self.prefix + middle
        self._check_grid(f"{begin}master", k, self.costmap.costs)
        self._check_place(begin, k, self.costmap.spec)
        if f"{begin}resolution" in self.recorded:
            recorded = self.recorded[f"{begin}resolution"][k]
            self.comparison.exact(
                f"{begin}resolution[{k}]", self.costmap.spec.resolution_m, recorded
            )
        for name, layer in self.costmap.layers.items():
            if not isinstance(layer, GridLayer):
                continue
            # With one layer to compare its arrays are called "layer".
            names = [name, "layer"] if isinstance(layer, ObstacleLayer) else [name]
            for one in names:
                self._check_grid(f"{begin}{one}", k, layer.grid.costs, needed=False)
                self._check_place(f"{begin}{one}_", k, layer.grid.spec)
            if isinstance(layer, VoxelLayer):
                self._check_grid(f"{begin}voxels", k, columns(layer.voxels), needed=False)

    def _check_grid(self, name: str, k: int, found: np.ndarray, needed: bool = True) -> None:
        """Compare with ``<name>_<k>``, or with plane ``k`` of ``<name>`` where they are stacked."""
        if f"{name}_{k:03d}" in self.recorded:
            self.comparison.exact(f"{name}_{k:03d}", found, self.recorded[f"{name}_{k:03d}"])
        elif needed or name in self.recorded:
            self.comparison.exact(f"{name}[{k}]", found, self.recorded[name][k])

    def _check_place(self, begin: str, k: int, spec: GridSpec) -> None:
        name = f"{begin}origin"
        if name in self.recorded:
            found = [spec.origin_x_m, spec.origin_y_m]
            self.comparison.exact(f"{name}[{k}]", found, self.recorded[name][k])

    def _check_current_after(self, event: Any) -> None:
        if "current_after" in event:
            found = self.costmap.is_current(event["now"])
            self.comparison.exact(f"current_after {event['type']}", found, event["current_after"])

    def _check_observation(self, layer: ObstacleLayer, event: Any) -> None:
        buffer = layer.buffers[self._source(layer, event)]
        number = f"{event['index']:03d}"
        self.comparison.exact(
            f"n_observations_after of event {number}",
            len(buffer.observations),
            event["n_observations_after"],
        )
        if buffer.observations:
            self.comparison.exact(
                f"obs_cloud_{number}",
                buffer.observations[0].points,
                self.recorded[f"obs_cloud_{number}"],
            )

    # -- what events hold ------------------------------------------------------------------

    def _source(self, layer: ObstacleLayer, event: Any) -> str:
        return list(layer.buffers)[event["source"]]

    def _poses(self, event: Any) -> Tuple[Pose3D, float, Pose3D]:
        origin = Pose3D(*self.recorded[f"obs_origin_{event['index']:03d}"].tolist())
        return _pose_of(event["sensor_in_map"]), event["now"], origin

    def _map_of(self, event: Any) -> StaticMap:
        occupancy = self.recorded[f"map_{event['index']:03d}"]
        size_y, size_x = occupancy.shape
        spec = GridSpec(size_x, size_y, event["resolution"], *event["origin"])
        return StaticMap(occupancy, spec, event["frame"])

    def _reconfigure_layer(self, layer: str, values: Any) -> None:
        """Take values as the layer's own server of dynamic_reconfigure does."""
        self._layer(layer)
        self.configuration = updated(self.configuration, f"{self.name}/{layer}", _as_set(values))
        params = dict(getattr(self.configuration, self.name).layers)[layer]
        self.costmap.reconfigure_layer(layer, params)


def columns(voxels: np.ndarray) -> np.ndarray:
    """Voxels uint8[H, W, Z] as the original keeps them: uint32[H, W], two bits for each."""
    low = np.full(voxels.shape[:2], 2**_BITS - 1, dtype=np.uint32)
    high = np.zeros(voxels.shape[:2], dtype=np.uint32)
    for z in range(voxels.shape[2]):
        bit = np.uint32(1 << z)
        low[voxels[:, :, z] == FREE] &= ~bit
        high[voxels[:, :, z] == LETHAL] |= bit
    return low | high << np.uint32(_BITS)


def _global_name(topic: str) -> str:
    return "/" + topic.lstrip("/")


def _pose_of(numbers: Sequence[float]) -> Pose3D:
    x, y, z, qx, qy, qz, qw = numbers
    return Pose3D(x, y, z, (qx, qy, qz, qw))
