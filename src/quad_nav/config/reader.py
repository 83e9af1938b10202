"""Check one namespace of a parameter tree against its table.

``normalise`` changes a namespace as move_base does on the parameter server: values get the
parameter's type, ranges are clamped, and all reconfigurable parameters are set. Dataclasses are
made from normalised namespaces, which hold no faults.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Callable, Dict, Iterable, Mapping, Optional, Tuple, Type, TypeVar, cast

from quad_nav.config.notes import CLAMPED, IGNORED, RENAMED, UNSUPPORTED, Notes, join
from quad_nav.config.plugins import Interface, load_class
from quad_nav.errors import InputError
from quad_nav.parameter import InvalidValue, Parameter, parameters_of

_Params = TypeVar("_Params")
Namespace = Dict[str, Any]
RESTORE_DEFAULTS = Parameter(
    "restore_defaults", "bool", False, "Restore to the original configuration."
)


@dataclass(frozen=True)
class Table:
    """Parameters of one namespace.

    Attributes:
        owners: Dataclasses that declare the parameters; a parameter of several owners is one.
        restores: True if dynamic_reconfigure can restore the namespace.
        is_own: True if upstream has no such namespace.
        unsupported: Name -> reason of keys that move_base reads and this package does not.
        ignored: Name -> reason of keys that move_base ignores too.
        renamed: Old name -> name; the old one still works.
        inherited: Parameters that may be at the node's level too.
        look: Adds remarks on values as they were written.
    """

    owners: Tuple[type, ...]
    restores: bool = False
    is_own: bool = False
    unsupported: Mapping[str, str] = field(default_factory=dict)
    ignored: Mapping[str, str] = field(default_factory=dict)
    renamed: Mapping[str, str] = field(default_factory=dict)
    inherited: Tuple[str, ...] = ()
    look: Optional[Callable[[Namespace, str, Notes], None]] = None

    @property
    def reconfigurable(self) -> Tuple[Parameter, ...]:
        """Parameters that can change in flight: upstream's in its order, then our own."""
        found = [one for one in self._declared() if not one.is_fixed]
        first = [one for one in found if self.is_own or not one.is_own]
        added = [one for one in found if one.is_own and not self.is_own]
        restore = [RESTORE_DEFAULTS] if self.restores else []
        return (*first, *restore, *added)

    @property
    def fixed(self) -> Tuple[Parameter, ...]:
        """Parameters that are read once, at the start."""
        return tuple(one for one in self._declared() if one.is_fixed)

    @property
    def parameters(self) -> Tuple[Parameter, ...]:
        """All parameters, the reconfigurable ones first."""
        return self.reconfigurable + self.fixed

    def __getitem__(self, name: str) -> Parameter:
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise KeyError(name)

    def _declared(self) -> Tuple[Parameter, ...]:
        found = {one.name: one for owner in self.owners for one in parameters_of(owner)}
        return tuple(found.values())


def normalise(
    namespace: Namespace, path: str, table: Table, notes: Notes, also_known: Iterable[str] = ()
) -> None:
    """Check and complete a namespace in place; ``also_known`` are keys that others describe."""
    if table.look is not None:
        table.look(namespace, path, notes)
    for old in table.renamed:
        if old in namespace:
            _rename(namespace, path, old, table.renamed[old], notes)
    for parameter in table.parameters:
        normalise_value(namespace, path, parameter, notes)
    for parameter in table.reconfigurable:
        namespace.setdefault(parameter.name, parameter.default)
    _remark_on_other_keys(namespace, path, table, notes, also_known)


def _rename(namespace: Namespace, path: str, old: str, new: str, notes: Notes) -> None:
    place = join(path, old)
    if new in namespace:
        notes.remark(place, IGNORED, f"ignored by move_base: {new} is set too")
        return
    namespace[new] = namespace[old]
    notes.moved(join(path, new), place)
    notes.remark(place, RENAMED, f"old name of {new}")


def normalise_value(namespace: Namespace, path: str, parameter: Parameter, notes: Notes) -> None:
    """Check and clamp a value in place, if it is set."""
    if parameter.name not in namespace:
        return
    given = namespace[parameter.name]
    place = join(path, parameter.name)
    try:
        checked = parameter.check(given)
    except InvalidValue as problem:
        notes.problem(place, str(problem))
        return
    value = parameter.clamp(checked)
    if value != checked:
        bound = "largest" if value < checked else "smallest"
        text = f"{given} clamped to {value}, the {bound} that move_base allows"
        notes.remark(place, CLAMPED, text)
    elif value != given:
        notes.remark(place, CLAMPED, f"{given} rounded to {value}; expected a whole number")
    namespace[parameter.name] = value


def _remark_on_other_keys(
    namespace: Namespace, path: str, table: Table, notes: Notes, also_known: Iterable[str]
) -> None:
    names = {parameter.name for parameter in table.parameters} | {*also_known, *table.renamed}
    for key in namespace:
        if key in names:
            continue
        place = join(path, str(key))
        if key in table.unsupported:
            reason = table.unsupported[key]
            notes.remark(place, UNSUPPORTED, f"not supported by this package: {reason}")
        elif key in table.ignored:
            notes.remark(place, IGNORED, f"ignored by move_base: {table.ignored[key]}")
        else:
            notes.unknown(place, str(key), names)


def made(
    owner: Type[_Params], namespace: Mapping[str, Any], given: Iterable[str] = (), **others: Any
) -> _Params:
    """Make a dataclass from a normalised namespace; what that lacks has its default.

    Args:
        owner: The dataclass, which declares the parameters.
        namespace: The normalised namespace.
        given: Names that were set. The others have their ``initial`` value, where they have one,
            until the first reconfiguration.
        others: Fields with other values than the namespace's.
    """
    given = set(given)
    arguments = {
        parameter.field: parameter.field_value(namespace[parameter.name])
        for parameter in parameters_of(cast(type, owner))
        if parameter.name in namespace and (parameter.initial is None or parameter.name in given)
    }
    return owner(**{**arguments, **others})


def subtree(tree: Namespace, name: str, path: str, notes: Notes) -> Namespace:
    """Return the namespace of that name; create it if it is missing, report it if it is a value."""
    value = tree.setdefault(name, {})
    if value is None:  # a YAML key with nothing below it
        value = tree[name] = {}
    if not isinstance(value, dict):
        notes.problem(join(path, name), f"{value!r} is a value; expected a namespace of parameters")
        value = tree[name] = {}
    return value


def named_types(entries: Any, place: str, kind: str, notes: Notes) -> Dict[str, str]:
    """Return name -> type of a list of ``{name: , type: }``; report entries of another form.

    ``kind`` is what an entry names, with its article.
    """
    expected = "expected {name: , type: }"
    if not isinstance(entries, list):
        notes.problem(place, f"{entries!r} is not a list; expected a list of {{name: , type: }}")
        return {}
    found: Dict[str, str] = {}
    for entry in entries:
        words = (entry.get("name"), entry.get("type")) if isinstance(entry, dict) else ()
        if not words or not all(isinstance(word, str) for word in words):
            notes.problem(place, f"{entry!r} is not {kind}; {expected}")
        elif entry["name"] in found:
            notes.problem(place, f"{entry['name']!r} is used twice; expected unique names")
        else:
            found[entry["name"]] = entry["type"]
    return found


def check_class(name: str, interface: Interface, place: str, notes: Notes) -> Any:
    """Return a user's class; None, and a fault for everything that it lacks of the interface."""
    try:
        return load_class(name, interface)
    except InputError as error:
        for problem in error.problems:
            notes.problem(place, problem)
        return None
