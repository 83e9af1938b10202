"""What a figure was measured with."""

from __future__ import annotations

import platform
from importlib import metadata
from typing import Dict

import quad_nav

# What the result of a flight depends on.
_LIBRARIES = ("numpy", "numba", "pybullet")


def versions() -> Dict[str, str]:
    """Names and versions of the package, Python and the libraries that compute a flight."""
    found = {"quad": quad_nav.__version__, "python": platform.python_version()}
    for library in _LIBRARIES:
        found[library] = metadata.version(library)
    return found
