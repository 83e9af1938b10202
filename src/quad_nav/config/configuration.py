"""A whole configuration, made from a parameter tree."""

from __future__ import annotations

import copy
from dataclasses import dataclass, field
from typing import Any, Dict, Iterable, Mapping, Optional, Tuple

from quad_nav.config import tables
from quad_nav.config.costmaps import costmap_params, remark_on_blindness, settle_costmap
from quad_nav.config.fixes import FIXES, FIXES_TABLE, with_fixes
from quad_nav.config.notes import CAUTION, Notes, Remark, join
from quad_nav.config.planners import (
    local_planner_frequency,
    local_planner_period_s,
    planner_keys,
    planner_params,
    settle_planner_names,
    settle_planners,
)
from quad_nav.config.plugins import plugin_name
from quad_nav.config.reader import fields, settle, subtree
from quad_nav.config.recoveries import (
    NamedTypes,
    RecoveryParams,
    circumscribed_radius_m,
    listed_names,
    recoveries,
    settle_recoveries,
)
from quad_nav.config.workload import workload_problems
from quad_nav.costmap.layered import CostmapParams
from quad_nav.costmap.scan_validator import ScanValidatorParams
from quad_nav.errors import InputError
from quad_nav.navigator.params import NavigatorParams
from quad_nav.navigator.progress_checker import ProgressParams
from quad_nav.peers.params import PeerParams

COSTMAPS = ("global_costmap", "local_costmap")
# Costmaps look for these upwards, so they may stand at the node's level.
_INHERITED = ("footprint", "robot_radius", "obstacle_range", "raytrace_range")


@dataclass(frozen=True)
class Configuration:
    """Everything that one navigator is made of.

    ``global_planner`` and ``local_planner`` are the parameters of the planners that
    ``navigator`` names: the dataclass of a planner, or a ``Plugin`` of the user's.
    ``recoveries`` are (name, parameters) in the order in which they are tried.
    ``local_planner_period_s`` is the control period that rollouts reckon with;
    it may differ from the loop's own, as in the original. ``clearing_radius_m`` is
    half the side of the square that ``make_plan`` clears around the robot. ``robot`` is
    the robot's number among the ``robots`` that fly together.
    """

    navigator: NavigatorParams
    peers: PeerParams
    scan_validator: ScanValidatorParams
    global_costmap: CostmapParams
    local_costmap: CostmapParams
    global_planner: Any
    local_planner: Any
    recoveries: Tuple[Tuple[str, RecoveryParams], ...]
    local_planner_period_s: float
    clearing_radius_m: float
    robot: int = 0
    robots: int = 1
    remarks: Tuple[Remark, ...] = ()
    tree: Mapping[str, Any] = field(default_factory=dict, repr=False, compare=False)
    tree_at_start: Mapping[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @property
    def warnings(self) -> Tuple[str, ...]:
        """The remarks as lines."""
        return tuple(map(str, self.remarks))

    def to_tree(self) -> Dict[str, Any]:
        """The parameter tree with ROS spellings, as the original leaves it on the server.

        What is reconfigurable is there with its value, everything else only when
        it was set.
        """
        return copy.deepcopy(dict(self.tree))


def load(tree: Mapping[str, Any], place: str = "") -> Configuration:
    """The configuration that the original would fly with.

    Args:
        tree: the parameters of a move_base node, from ``load_files`` or a
            parameter server. It may be one that a navigator left there before.
        place: what messages name in front of paths, such as the node's name.

    Raises:
        InputError: one line for every value that cannot be used.
    """
    if not isinstance(tree, Mapping):
        raise InputError([f"{place}: {tree!r} is no parameter tree; expected names with values"])
    notes = Notes(place, getattr(tree, "origins", None))
    notes.remarks.extend(getattr(tree, "remarks", ()))
    settled = copy.deepcopy(dict(tree))
    listed = _settle(settled, notes)
    notes.raise_problems()

    costmaps = [costmap_params(settled, name) for name in COSTMAPS]
    for name, params in zip(COSTMAPS, costmaps):
        remark_on_blindness(params, name, notes)
    _remark_on_rates(settled, notes)
    pruned = _without_empty(settled)
    configuration = Configuration(
        navigator=navigator_params(settled, listed, given=tree),
        peers=with_fixes(PeerParams(), settled),
        scan_validator=with_fixes(ScanValidatorParams(), settled),
        global_costmap=costmaps[0],
        local_costmap=costmaps[1],
        global_planner=planner_params(settled, "base_global_planner"),
        local_planner=planner_params(settled, "base_local_planner"),
        recoveries=recoveries(settled, listed),
        local_planner_period_s=local_planner_period_s(settled),
        clearing_radius_m=settled.get("clearing_radius", circumscribed_radius_m(settled)),
        robot=settled.get("robot", 0),
        robots=settled.get("robots", 1),
        remarks=tuple(notes.remarks),
        tree=pruned,
        tree_at_start=pruned,
    )
    for name, problem in workload_problems(configuration):
        notes.problem(name, problem)
    notes.raise_problems()
    return configuration


def navigator_params(
    tree: Mapping[str, Any], listed: Optional[NamedTypes], given: Iterable[str]
) -> NavigatorParams:
    """The dataclass of a settled tree; ``given`` are the keys that somebody set."""
    params = NavigatorParams(
        recovery_behaviors=listed,
        progress=with_fixes(ProgressParams(), tree),
        **fields(tree, tables.NAVIGATOR.parameters, given),
    )
    return with_fixes(params, tree)


def _settle(tree: Dict[str, Any], notes: Notes) -> Optional[NamedTypes]:
    """Brings the whole tree into the state in which the original leaves it."""
    settle_planner_names(tree, notes)
    known = [
        *COSTMAPS,
        FIXES,
        *planner_keys(tree),
        *_INHERITED,
        "recovery_behaviors",
        *listed_names(tree),
    ]
    settle(tree, "", tables.NAVIGATOR, notes, also_known=known)
    settle_planners(tree, notes)
    settle(subtree(tree, FIXES, "", notes), FIXES, FIXES_TABLE, notes)
    for name in COSTMAPS:
        settle_costmap(tree, name, notes)
    return settle_recoveries(tree, notes)


def _remark_on_rates(tree: Mapping[str, Any], notes: Notes) -> None:
    own_hz = local_planner_frequency(tree)
    loop_hz = tree["controller_frequency"]
    if own_hz is not None and own_hz != loop_hz:
        planner = plugin_name(tree["base_local_planner"])
        notes.remark(
            join(planner, "controller_frequency"),
            CAUTION,
            f"rollouts reckon with {own_hz} Hz, while the loop runs at {loop_hz} Hz",
        )


def _without_empty(tree: Mapping[str, Any]) -> Dict[str, Any]:
    """Namespaces that hold nothing are not on a parameter server."""
    pruned = {}
    for key, value in tree.items():
        value = _without_empty(value) if isinstance(value, dict) else value
        if value != {}:
            pruned[key] = value
    return pruned
