"""YAML that stays as small in memory as it is on disk.

Anchors and aliases may share nodes, as YAML allows, but each use of a shared node counts, so that
a few lines cannot become a billion values.
"""

from __future__ import annotations

from typing import Any, Dict, Optional, Tuple

import yaml

MAX_BYTES = 4 * 1024 * 1024
MAX_NODES = 200_000
MAX_LEVELS = 50
MAX_DIGITS = 100
"""Digits of a whole number: more than 308 exceed any float, thousands take long to parse."""


class PlainLoader(yaml.SafeLoader):
    """``yaml.SafeLoader`` within these limits; every fault is a ``yaml.YAMLError``."""

    def __init__(self, stream: Any) -> None:
        super().__init__(stream)
        self._levels = self._nodes = 0
        self._extents: Dict[yaml.Node, Tuple[int, int]] = {}

    def compose_node(self, parent: Optional[yaml.Node], index: Any) -> Optional[yaml.Node]:
        """Compose a node and count its values and levels."""
        event: yaml.Event = self.peek_event()  # type: ignore[no-untyped-call]
        mark: Any = event.start_mark
        is_alias = isinstance(event, yaml.AliasEvent)
        self._levels += 1
        if self._levels > MAX_LEVELS:
            raise _refusal(f"more than {MAX_LEVELS} levels inside each other", mark)
        self._nodes += 1
        if self._nodes > MAX_NODES:  # now, not at the end of the node that contains them
            raise _refusal(f"more than {MAX_NODES} values", mark)
        node = super().compose_node(parent, index)
        self._levels -= 1
        if node is not None and node not in self._extents:
            if is_alias:  # of a node that is not complete yet
                raise _refusal("an alias stands in what it stands for", mark)
            self._extents[node] = self._extent(node, mark)
        return node

    def _extent(self, node: yaml.Node, mark: yaml.Mark) -> Tuple[int, int]:
        """Number of nodes below and including a node, and number of its levels."""
        if isinstance(node, yaml.ScalarNode):
            return 1, 1
        below = list(node.value)
        if isinstance(node, yaml.MappingNode):
            below = [one for pair in node.value for one in pair]
        extents = [self._extents[one] for one in below]
        nodes = 1 + sum(count for count, _ in extents)
        levels = 1 + max((levels for _, levels in extents), default=0)
        if nodes > MAX_NODES:
            raise _refusal(f"more than {MAX_NODES} values", mark)
        if levels > MAX_LEVELS:
            raise _refusal(f"more than {MAX_LEVELS} levels inside each other", mark)
        return nodes, levels

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        """Construct a value; a value that does not fit its tag is a ``yaml.YAMLError``."""
        if node.tag == "tag:yaml.org,2002:int" and len(node.value) > MAX_DIGITS:
            raise _refusal(f"a number with more than {MAX_DIGITS} digits", node.start_mark)
        try:
            return super().construct_object(node, deep)
        except (ValueError, TypeError, LookupError, AttributeError, OverflowError) as error:
            # yaml's constructors expect that a value fits its tag: !!int x, 2001-99-99.
            raise _refusal(
                f"not a value of the type {node.tag.split(':')[-1]}", node.start_mark
            ) from error


def load(text: str) -> Any:
    """Return the single document of a YAML text.

    Raises:
        yaml.YAMLError: The text is not YAML, or exceeds a limit.
    """
    return yaml.load(text, Loader=PlainLoader)  # noqa: S506, it is a SafeLoader


def _refusal(problem: str, mark: yaml.Mark) -> yaml.YAMLError:
    return yaml.constructor.ConstructorError(None, None, problem, mark)
