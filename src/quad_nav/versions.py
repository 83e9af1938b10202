"""Versions of the package and of the libraries that compute a flight."""

from __future__ import annotations

import platform
from importlib import metadata
from pathlib import Path
from typing import Dict, Sequence
from xml.etree import ElementTree

DISTRIBUTION = "quad-nav"
# The result of a flight depends on these. Newer Pythons have pybullet from a fork of that name.
_LIBRARIES = {"numpy": ("numpy",), "numba": ("numba",), "pybullet": ("pybullet", "pybullet-arm64")}


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
    for library, distributions in _LIBRARIES.items():
        found[library] = _version_of_any(distributions)
    return found


def _version_of_any(distributions: Sequence[str]) -> str:
    """Return the version of the first of these distributions that is installed."""
    for name in distributions[:-1]:
        try:
            return metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return metadata.version(distributions[-1])
