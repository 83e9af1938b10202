"""The configuration of one navigator, made from a parameter tree."""

from __future__ import annotations

import copy
from dataclasses import dataclass, field, replace
from typing import Any, Dict, Iterable, Iterator, List, Mapping, Optional, Tuple

from quad_nav.config.cautions import cautions
from quad_nav.config.costmaps import (
    COSTMAP_TABLE,
    FOOTPRINT_KEYS,
    costmap_params,
    normalise_costmap,
)
from quad_nav.config.files import COSTMAPS, below
from quad_nav.config.filters import (
    COMMAND_FILTERS,
    SCAN_FILTERS,
    filter_names,
    filters_of,
    normalise_filters,
)
from quad_nav.config.fixes import GROUPS, normalise_groups, own_params, with_fixes
from quad_nav.config.layers import LAYERS, SOURCE_TABLE, source_names
from quad_nav.config.notes import CAUTION, MAPPED, OTHER_ROBOT, Notes, Remark, join
from quad_nav.config.planners import (
    SLOTS,
    local_planner_frequency,
    local_planner_period_s,
    normalise_planner_names,
    normalise_planners,
    planner_keys,
    planner_params,
    planner_table,
)
from quad_nav.config.plugins import Plugin, plugin_name
from quad_nav.config.reader import Table, made, normalise
from quad_nav.config.recoveries import (
    TABLES,
    NamedTypes,
    RecoveryParams,
    circumscribed_radius_m,
    full_type,
    listed_names,
    normalise_recoveries,
    recoveries,
)
from quad_nav.config.workload import rollout_problem, size_problem
from quad_nav.costmap.layered import CostmapParams
from quad_nav.costmap.scan_validator import ScanValidatorParams
from quad_nav.errors import InputError
from quad_nav.navigator.control_supervisor import ProgressParams
from quad_nav.navigator.params import NavigatorParams
from quad_nav.parameter import POSITIVE, fixed_flag, fixed_number, fixed_whole
from quad_nav.peers.peer_params import PeerParams

# Costmaps look for these upwards too, to the node's level.
_INHERITED = (*FOOTPRINT_KEYS, "obstacle_range", "raytrace_range")


@dataclass(frozen=True)
class Configuration:
    """The configuration of one navigator.

    Attributes:
        global_planner: Parameters of the planner that ``navigator`` names: its dataclass, or a
            ``Plugin`` of the user's. The same holds for ``local_planner``.
        recoveries: (name, parameters) in the order in which they are tried.
        scan_filters: (name, class and parameters) in their order.
        command_filters: The same.
        local_planner_period_s: Control period that rollouts assume; as in move_base it may differ
            from the period of the control loop.
        body_radius_m: None for a quadcopter's own.
        robot: If unset, the number in the node's name, its frames or its topics.
        robots: The peers are the other numbers below it; 0 for those on the ROS graph.
        remarks: Remarks on parameters that are legal and odd.
        tree: The normalised tree, with ROS spellings.
        tree_at_start: The tree that ``restore_defaults`` restores.
    """

    navigator: NavigatorParams
    peers: PeerParams
    scan_validator: ScanValidatorParams
    global_costmap: CostmapParams
    local_costmap: CostmapParams
    global_planner: Any
    local_planner: Any
    recoveries: Tuple[Tuple[str, RecoveryParams], ...]
    scan_filters: Tuple[Tuple[str, Plugin], ...]
    command_filters: Tuple[Tuple[str, Plugin], ...]
    local_planner_period_s: float
    clearing_radius_m: float = fixed_number(
        "clearing_radius", None, "metres", "Half the side of the square that make_plan clears."
    )

    # Our own
    body_radius_m: Optional[float] = fixed_number(
        "body_radius", None, "metres", "Radius of the simulated body.", POSITIVE, own=True
    )
    robot: int = fixed_whole("robot", 0, "Number of this robot in its fleet.", low=0, own=True)
    robots: int = fixed_whole("robots", 0, "Number of robots that fly together.", low=0, own=True)
    size_from_scene: bool = fixed_flag(
        "size_from_scene", False, "The global costmap has the size of the scene.", own=True
    )
    remarks: Tuple[Remark, ...] = ()
    tree: Mapping[str, Any] = field(default_factory=dict, repr=False, compare=False)
    tree_at_start: Mapping[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @property
    def warnings(self) -> Tuple[str, ...]:
        """Remarks as lines of text."""
        return tuple(map(str, self.remarks))

    @property
    def costmaps(self) -> Dict[str, CostmapParams]:
        """Both costmaps by name."""
        return {name: getattr(self, name) for name in COSTMAPS}

    @property
    def odom_topic(self) -> str:
        """Topic of the odometry; of the local planners, DWAPlannerROS can have another one."""
        return getattr(self.local_planner, "odom_topic", "") or "odom"

    def to_tree(self) -> Dict[str, Any]:
        """Return the parameter tree with ROS spellings, as move_base leaves it on the server.

        Reconfigurable parameters have their value in force; others are there if they were set.
        """
        return copy.deepcopy(dict(self.tree))


_OF_NODE = (NavigatorParams, ProgressParams, ScanValidatorParams, Configuration)
MOVE_BASE_TABLE = Table(_OF_NODE, restores=True)


def tables_of(tree: Mapping[str, Any]) -> Iterator[Tuple[str, Table, Mapping[str, Any]]]:
    """Yield (path, parameters, namespace) of what is known of a normalised tree.

    They are in the order of move_base's dynamic_reconfigure servers. Plugins are not known.
    """
    tables = {"": MOVE_BASE_TABLE}
    for key in SLOTS:
        planner = planner_table(tree, key) if key in tree else None
        if planner is not None:
            tables[plugin_name(tree[key])] = planner
    for costmap in COSTMAPS:
        tables[costmap] = COSTMAP_TABLE
        for plugin in below(tree, costmap).get("plugins", ()):
            layer = join(costmap, plugin["name"])
            if plugin["type"] in LAYERS:
                tables[layer] = LAYERS[plugin["type"]]
                for source in source_names(below(tree, layer)):
                    tables[join(layer, source)] = SOURCE_TABLE
    for entry in tree.get("recovery_behaviors", ()):
        if full_type(entry["type"]) in TABLES:
            tables[entry["name"]] = TABLES[full_type(entry["type"])]
    for path, table in {**tables, **GROUPS}.items():
        yield path, table, below(tree, path)


def load(tree: Mapping[str, Any], place: str = "") -> Configuration:
    """Make the configuration that move_base would fly with.

    Args:
        tree: The parameters of a move_base node, from ``load_files`` or a parameter server. The
            tree that an earlier navigator left on the server will do.
        place: The prefix of paths in messages, such as the node's name.

    Raises:
        InputError: One line for every value that cannot be used.
    """
    if not isinstance(tree, Mapping):
        raise InputError([f"{place}: {tree!r} is not a parameter tree; expected names with values"])
    notes = Notes(place, getattr(tree, "origins", None))
    notes.remarks.extend(getattr(tree, "remarks", ()))
    notes.remarks.extend(_of_another_robot(tree.get(OTHER_ROBOT)))
    normalised = copy.deepcopy(dict(tree))
    listed = _normalise(normalised, notes)
    notes.raise_problems()

    configuration = _made(normalised, listed, tree)
    found = cautions(configuration.navigator, configuration.local_planner, configuration.costmaps)
    for place, text in found:
        notes.remark(place, CAUTION, text)
    _remark_on_rates(normalised, notes)
    for name, problem in workload_problems(configuration):
        notes.problem(name, problem)
    notes.raise_problems()
    return replace(configuration, remarks=tuple(notes.remarks))


def workload_problems(configuration: Configuration) -> Iterator[Tuple[str, str]]:
    """Yield (namespace, problem) of everything that is too much for a machine."""
    local_planner = plugin_name(configuration.navigator.base_local_planner)
    found = {
        "global_costmap": size_problem(configuration.global_costmap),
        "local_costmap": size_problem(configuration.local_costmap),
        local_planner: rollout_problem(configuration.local_planner),
    }
    return ((name, problem) for name, problem in found.items() if problem)


def _made(
    tree: Dict[str, Any], listed: Optional[NamedTypes], given: Iterable[str]
) -> Configuration:
    """Make the dataclasses of a normalised tree."""
    pruned = _without_empty(tree)
    return made(
        Configuration,
        tree,
        **changing_parts(tree, listed, given),
        recoveries=recoveries(tree, listed),
        scan_filters=filters_of(tree, SCAN_FILTERS),
        command_filters=filters_of(tree, COMMAND_FILTERS),
        local_planner_period_s=local_planner_period_s(tree),
        clearing_radius_m=tree.get("clearing_radius", circumscribed_radius_m(tree)),
        tree=pruned,
        tree_at_start=pruned,
    )


def changing_parts(
    tree: Mapping[str, Any], listed: Optional[NamedTypes], given: Iterable[str]
) -> Dict[str, Any]:
    """Make the fields of a ``Configuration`` that may change in flight from a normalised tree.

    ``listed`` has (name, type) of the ``recovery_behaviors``, None without that list; ``given``
    the keys that were set.
    """
    progress = own_params(ProgressParams, tree)
    navigator = made(NavigatorParams, tree, given, recovery_behaviors=listed, progress=progress)
    return {
        "navigator": with_fixes(navigator, tree),
        "peers": own_params(PeerParams, tree, "peers"),
        "scan_validator": own_params(ScanValidatorParams, tree),
        "global_planner": planner_params(tree, "base_global_planner"),
        "local_planner": planner_params(tree, "base_local_planner"),
        **{name: costmap_params(tree, name) for name in COSTMAPS},
    }


def _normalise(tree: Dict[str, Any], notes: Notes) -> Optional[NamedTypes]:
    """Normalise the whole tree as move_base does; return the listed recoveries."""
    normalise_planner_names(tree, notes)
    known = [
        *COSTMAPS,
        *GROUPS,
        OTHER_ROBOT,
        *planner_keys(tree),
        *_INHERITED,
        "recovery_behaviors",
        *listed_names(tree),
        *filter_names(tree),
    ]
    normalise(tree, "", MOVE_BASE_TABLE, notes, also_known=known)
    normalise_planners(tree, notes)
    normalise_groups(tree, notes)
    normalise_filters(tree, notes)
    for name in COSTMAPS:
        normalise_costmap(tree, name, notes)
    return normalise_recoveries(tree, notes)


def _of_another_robot(lines: Any) -> List[Remark]:
    """Return the remarks of a configuration that was adapted before it reached the server."""
    given = map(str, lines) if isinstance(lines, list) else ()
    parts = [line.partition(": ") for line in given]
    return [Remark(place, MAPPED, text) for place, _, text in parts]


def _remark_on_rates(tree: Mapping[str, Any], notes: Notes) -> None:
    own_hz = local_planner_frequency(tree)
    loop_hz = tree["controller_frequency"]
    if own_hz is not None and own_hz != loop_hz:
        place = join(plugin_name(tree["base_local_planner"]), "controller_frequency")
        text = f"rollouts assume {own_hz} Hz, but the control loop runs at {loop_hz} Hz"
        notes.remark(place, CAUTION, text)


def _without_empty(tree: Mapping[str, Any]) -> Dict[str, Any]:
    """Return the tree without empty namespaces, which a parameter server does not store."""
    pruned = {}
    for key, value in tree.items():
        value = _without_empty(value) if isinstance(value, dict) else value
        if value != {}:
            pruned[key] = value
    return pruned
