"""Versions of the package and of the libraries that compute a flight."""

from __future__ import annotations

import platform
from importlib import metadata
from pathlib import Path
from typing import Dict
from xml.etree import ElementTree

DISTRIBUTION = "quad-nav"
# The result of a flight depends on these.
_LIBRARIES = ("numpy", "numba", "pybullet")


def package_version() -> str:
    """Return the version that ``package.xml`` states.

    A checkout reads the file itself. pip and catkin copied its version into the metadata of the
    installed distribution.
    """
    manifest = Path(__file__).resolve().parents[2] / "package.xml"
    if manifest.is_file():
        return str(ElementTree.parse(manifest).findtext("version"))
    return metadata.version(DISTRIBUTION)


def versions() -> Dict[str, str]:
    """Return name -> version of the package, Python and the libraries that compute a flight."""
    found = {"quad": package_version(), "python": platform.python_version()}
    for library in _LIBRARIES:
        found[library] = metadata.version(library)
    return found
