"""Parameters on the command line."""

from __future__ import annotations

from typing import Any, Tuple

import yaml

from quad_nav.errors import InputError
from quad_nav.files import plain_yaml


def parameter(text: str) -> Tuple[str, Any]:
    """The path and the value of "global_costmap/width=60"; values are written as in YAML.

    Raises:
        InputError: it is not written so.
    """
    path, equals, value = text.partition("=")
    if not equals or not path.strip("/"):
        raise InputError([f"--set {text}: expected PATH=VALUE, as global_costmap/width=60"])
    try:
        return path, plain_yaml.load(value)
    except yaml.YAMLError as error:
        raise InputError(
            [
                f"--set {text}: {value!r} is not YAML, expected a value as in a "
                f"parameter file: {error}"
            ]
        ) from error
