"""YAML that stays as small in memory as it is on disk.

Nodes may be shared by anchors and aliases, as YAML allows, but what they stand for is
counted as often as it is used, so that a few lines cannot become a billion values.
"""

from __future__ import annotations

from typing import Any, Dict, Optional, Tuple

import yaml

MOST_BYTES = 4 * 1024 * 1024
MOST_NODES = 200_000
MOST_LEVELS = 50
MOST_DIGITS = 100
"""A whole number with more than 308 is larger than any float; with thousands it takes long."""


class PlainLoader(yaml.SafeLoader):
    """``yaml.SafeLoader`` within these limits; every fault is a ``yaml.YAMLError``."""

    def __init__(self, stream: Any):
        super().__init__(stream)
        self._levels = self._nodes = 0
        self._extents: Dict[yaml.Node, Tuple[int, int]] = {}

    def compose_node(self, parent: Optional[yaml.Node], index: Any) -> Optional[yaml.Node]:
        mark, is_alias = self.peek_event().start_mark, self.check_event(yaml.AliasEvent)
        self._levels += 1
        if self._levels > MOST_LEVELS:
            raise _refusal(f"more than {MOST_LEVELS} levels inside each other", mark)
        self._nodes += 1
        if self._nodes > MOST_NODES:  # without waiting for the end of what they are in
            raise _refusal(f"more than {MOST_NODES} values", mark)
        node = super().compose_node(parent, index)
        self._levels -= 1
        if node is not None and node not in self._extents:
            if is_alias:  # of something that has not come to its end yet
                raise _refusal("an alias stands in what it stands for", mark)
            self._extents[node] = self._extent(node, mark)
        return node

    def _extent(self, node: yaml.Node, mark: yaml.Mark) -> Tuple[int, int]:
        """How many nodes it stands for, and in how many levels."""
        if isinstance(node, yaml.ScalarNode):
            return 1, 1
        below = list(node.value)
        if isinstance(node, yaml.MappingNode):
            below = [one for pair in node.value for one in pair]
        extents = [self._extents[one] for one in below]
        nodes = 1 + sum(count for count, _ in extents)
        levels = 1 + max((levels for _, levels in extents), default=0)
        if nodes > MOST_NODES:
            raise _refusal(f"more than {MOST_NODES} values", mark)
        if levels > MOST_LEVELS:
            raise _refusal(f"more than {MOST_LEVELS} levels inside each other", mark)
        return nodes, levels

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        if node.tag == "tag:yaml.org,2002:int" and len(node.value) > MOST_DIGITS:
            raise _refusal(f"a number with more than {MOST_DIGITS} digits", node.start_mark)
        try:
            return super().construct_object(node, deep)
        except (ValueError, TypeError, LookupError, AttributeError, OverflowError) as error:
            # yaml's constructors expect that a value fits its tag: !!int x, 2001-99-99.
            raise _refusal(
                f"not a value of the type {node.tag.split(':')[-1]}", node.start_mark
            ) from error


def load(text: str) -> Any:
    """The one document of a text. Raises ``yaml.YAMLError``."""
    return yaml.load(text, Loader=PlainLoader)


def _refusal(problem: str, mark: yaml.Mark) -> yaml.YAMLError:
    return yaml.constructor.ConstructorError(None, None, problem, mark)
