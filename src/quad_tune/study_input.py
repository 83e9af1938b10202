"""Read and check what a study flies."""

from __future__ import annotations

from pathlib import Path
from typing import Any, List, Sequence, Tuple, Union

from quad_nav import config
from quad_nav.config.files import set_value
from quad_nav.config.notes import without_effect
from quad_nav.config.robot_tree import RobotSource, fitted, unfitted_tree
from quad_nav.errors import InputError
from quad_tune.space import costmap_paths


def parameter_faults(
    parameters: Sequence[Tuple[str, Any]], source: Union[str, Path], name: str
) -> List[str]:
    """Return invalid values, and parameters that have no effect.

    Args:
        parameters: (path, value) pairs on top of the base configuration.
        source: The base configuration.
        name: Origin of the parameters, for the messages.
    """
    tree = unfitted_tree(RobotSource(str(source), 0))
    paths = []
    for path, value in parameters:
        for single in costmap_paths(path):
            set_value(tree, single, value, name)
            paths.append(single)
    try:
        remarks = config.load(fitted(tree, 0)).remarks
    except InputError as error:
        return list(error.problems)
    return without_effect(remarks, paths, str(source))
