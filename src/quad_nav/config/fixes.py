"""Groups of parameters that upstream does not have, and ``fixes/upstream``.

``fixes/upstream: true`` restores the C++ move_base: every deviation is off, whatever its own
parameter says. The others keep their values.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, Mapping, Type, TypeVar

from quad_nav.config.notes import UNKNOWN, Notes, join
from quad_nav.config.plugins import plugin_name
from quad_nav.config.reader import Namespace, Table, made, normalise, subtree
from quad_nav.costmap.scan_validator import ScanValidatorParams
from quad_nav.navigator.control_supervisor import ProgressParams
from quad_nav.navigator.params import DEFAULT_LOCAL_PLANNER, NavigatorParams
from quad_nav.parameter import as_upstream, flag, parameters_of
from quad_nav.peers.peer_params import PeerParams

FIXES = "fixes"
_Params = TypeVar("_Params")


@dataclass(frozen=True)
class FixesParams:
    """The switch of all deviations from upstream."""

    upstream: bool = flag("upstream", False, "Behave as the C++ move_base, without any deviation.")


def _group(*owners: type) -> Table:
    return Table(owners, restores=True, is_own=True)


GROUPS: Dict[str, Table] = {
    "peers": _group(PeerParams),
    FIXES: _group(FixesParams),
}
"""Name of each group below the node's own namespace -> its parameters."""

# Parameters that stood in the group ``fixes`` and are now at the node's level.
_OF_NODE = (NavigatorParams, ProgressParams, ScanValidatorParams)
# Words that these had before their names there.
_OLD_WORDS = {"peers": "peer_"}


def normalise_groups(tree: Namespace, notes: Notes) -> None:
    """Normalise the groups; say where parameters are that stood in ``fixes``."""
    fixes = subtree(tree, FIXES, "", notes)
    known = {parameter.name for parameter in GROUPS[FIXES].parameters}
    for key in fixes:
        if key not in known:
            new = _new_place(str(key))
            notes.remark(join(FIXES, str(key)), UNKNOWN, "nothing reads it here", new)
    for name, table in GROUPS.items():
        also = fixes if name == FIXES else ()
        normalise(subtree(tree, name, "", notes), name, table, notes, also_known=also)


def _new_place(name: str) -> str:
    """Return the place of a parameter that stood in ``fixes``, else the switch of all of them."""
    for group, table in GROUPS.items():
        for parameter in table.parameters:
            if name in (parameter.name, _OLD_WORDS.get(group, "") + parameter.name):
                return join(group, parameter.name)
    if any(one.is_own and one.name == name for owner in _OF_NODE for one in parameters_of(owner)):
        return name
    if name == "respect_meter_scoring":
        return join(plugin_name(DEFAULT_LOCAL_PLANNER), name)
    return join(FIXES, "upstream")


def is_upstream(tree: Mapping[str, Any]) -> bool:
    """Tell if a normalised tree has the deviations from upstream off."""
    return tree.get(FIXES, {}).get("upstream", False) is True


def with_fixes(params: _Params, tree: Mapping[str, Any]) -> _Params:
    """Return parameters without their deviations from upstream, if a tree has these off."""
    return as_upstream(params) if is_upstream(tree) else params


def own_params(owner: Type[_Params], tree: Mapping[str, Any], group: str = "") -> _Params:
    """Make a dataclass of our own parameters from a group of a normalised tree, or its top."""
    return with_fixes(made(owner, tree.get(group, {}) if group else tree), tree)
